#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <string>

#include "physics/dynamics/world.h"
#include "physics/model/build.h"
#include "physics/model/identify/link_fit.h"
#include "render/renderer.h"

// What scene files, options and results call the values of enumerations: all names of a type, in its order.
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
constexpr auto namesOf(BuildMethod) {
  return std::array{"cover", "skeleton"};
}
constexpr auto namesOf(LinkForm) {
  return std::array{"diagonal", "uncoupled", "full"};
}
constexpr auto namesOf(ViewKind) {
  return std::array{"tissue", "model", "both"};
}
constexpr auto namesOf(Quality) {
  return std::array{"draft", "standard", "best"};
}

template <typename E>
constexpr const char* nameOf(E value) {
  return namesOf(value)[static_cast<std::size_t>(value)];
}
// Of a name that is one of them.
template <typename E>
E valueNamed(const std::string& name) {
  const auto names = namesOf(E{});
  const auto found = std::find(names.begin(), names.end(), name);
  assert(found != names.end());
  return static_cast<E>(found - names.begin());
}

static_assert(nameOf(Integrator::implicit)[0] == 'i' && nameOf(ContactMode::balls)[0] == 'b' &&
              nameOf(LinkModel::beam)[0] == 'b' && nameOf(SurfaceMode::skin)[1] == 'k' &&
              nameOf(FixedFreedom::all)[0] == 'a' && nameOf(StaticShape::Kind::mesh)[0] == 'm' &&
              nameOf(BuildMethod::skeleton)[0] == 's' && nameOf(LinkForm::full)[0] == 'f' &&
              nameOf(ViewKind::both)[0] == 'b' && nameOf(Quality::best)[0] == 'b');

}  // namespace medulla
