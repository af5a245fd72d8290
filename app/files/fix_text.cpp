#include "app/files/fix_text.h"

#include <fmt/core.h>

#include <filesystem>
#include <optional>
#include <stdexcept>

#include "app/files/number_text.h"
#include "app/files/vertex_file.h"
#include "physics/dynamics/region.h"

namespace medulla {

namespace {

[[noreturn]] void refuse(const std::string& text, const char* expected) {
  throw std::runtime_error(fmt::format("--fix {}: expected {}", text, expected));
}

// Numbers between commas; of another count or no numbers: refused.
std::vector<double> numbersOf(const std::string& text, std::string_view list, std::size_t count, const char* expected) {
  std::vector<double> out;
  for (bool more = true; more;) {
    const std::size_t comma = list.find(',');
    more = comma != std::string_view::npos;
    const std::optional<double> value = parseNumber<double>(list.substr(0, comma));
    if (!value) refuse(text, expected);
    out.push_back(*value);
    if (more) list.remove_prefix(comma + 1);
  }
  if (out.size() != count) refuse(text, expected);
  return out;
}

Region regionOf(const std::string& text, std::string_view kind, std::string_view list) {
  Region region;
  if (kind == "box") {
    constexpr const char* expected = "box=x0,y0,z0,x1,y1,z1 with the lower corner first";
    const std::vector<double> v = numbersOf(text, list, 6, expected);
    region.box = {Eigen::Vector3d(v[0], v[1], v[2]), Eigen::Vector3d(v[3], v[4], v[5])};
    if (region.box.isEmpty()) refuse(text, expected);
  } else if (kind == "sphere") {
    constexpr const char* expected = "sphere=x,y,z,r with a radius > 0";
    const std::vector<double> v = numbersOf(text, list, 4, expected);
    region.shape = Region::Shape::ball;
    region.centre = {v[0], v[1], v[2]};
    region.radius = v[3];
    if (!(region.radius > 0)) refuse(text, expected);
  } else if (kind == "plane") {
    constexpr const char* expected = "plane=nx,ny,nz,d with a direction that is not 0";
    const std::vector<double> v = numbersOf(text, list, 4, expected);
    region.shape = Region::Shape::halfSpace;
    region.normal = {v[0], v[1], v[2]};
    region.distance = v[3];
    if (region.normal.isZero()) refuse(text, expected);
  } else {
    refuse(text, "box=x0,y0,z0,x1,y1,z1, sphere=x,y,z,r, plane=nx,ny,nz,d or vertices=FILE.csv");
  }
  return region;
}

}  // namespace

HeldRegion parseHeldRegion(const std::string& text, const SoftBodyModel& model) {
  const std::size_t equals = text.find('=');
  const std::string kind = text.substr(0, equals), value = equals == std::string::npos ? "" : text.substr(equals + 1);
  HeldRegion held;
  held.text = text;
  if (kind == "vertices" && !value.empty()) {
    held.text = "vertices=" + std::filesystem::path(value).filename().string();
    held.nodes = readVertices(value, model);
    return held;
  }
  const Region region = regionOf(text, kind, value);
  held.nodes = nodesInRegion(model, region);
  held.isSpace = true;
  if (held.nodes.empty()) throw std::runtime_error(fmt::format("--fix {} holds no node of the surface", text));
  return held;
}

}  // namespace medulla
