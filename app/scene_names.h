#pragma once

#include <array>

#include "physics/dynamics/world.h"

// What scene files and results call the values of enumerations: all names of a type, in its order.
namespace medulla {

constexpr auto namesOf(Integrator) {
  return std::array{"explicit", "implicit"};
}
constexpr auto namesOf(ContactMode) {
  return std::array{"none", "balls", "swept"};
}
constexpr auto namesOf(LinkModel) {
  return std::array{"springs", "beam", "identified"};
}
constexpr auto namesOf(SurfaceMode) {
  return std::array{"full", "skin", "contact"};
}
constexpr auto namesOf(FixedFreedom) {
  return std::array{"translation", "all"};
}
constexpr auto namesOf(StaticShape::Kind) {
  return std::array{"plane", "box", "sphere", "mesh"};
}

template <typename E>
constexpr const char* nameOf(E value) {
  return namesOf(value)[static_cast<std::size_t>(value)];
}

static_assert(nameOf(Integrator::implicit)[0] == 'i' && nameOf(ContactMode::balls)[0] == 'b' &&
              nameOf(LinkModel::beam)[0] == 'b' && nameOf(SurfaceMode::skin)[1] == 'k' &&
              nameOf(FixedFreedom::all)[0] == 'a' && nameOf(StaticShape::Kind::mesh)[0] == 'm');

}  // namespace medulla
