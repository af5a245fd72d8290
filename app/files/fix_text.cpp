#include "app/files/fix_text.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/files/vertex_file.h"

namespace medulla {

namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& expected) {
  throw std::runtime_error(fmt::format("--fix {}: expected {}", text, expected));
}

// Numbers between commas, blanks around them or not; none at all where one of them is no number.
std::vector<double> numbersOf(std::string_view list) {
  std::vector<double> out;
  for (bool more = true; more;) {
    const std::size_t comma = list.find(',');
    more = comma != std::string_view::npos;
    const std::optional<double> value = parseNumber<double>(trimmed(list.substr(0, comma)));
    if (!value) return {};
    out.push_back(*value);
    if (more) list.remove_prefix(comma + 1);
  }
  return out;
}

// As a user would write it: "sphere=x,y,z,r".
std::string exampleOf(const RegionForm& form) {
  std::string numbers = form.numbers;
  std::replace(numbers.begin(), numbers.end(), ' ', ',');
  return fmt::format("{}={}", form.word, numbers);
}

Region regionOf(const std::string& text, std::string_view word, std::string_view list) {
  for (const RegionForm& form : kRegionForms) {
    if (word != form.word) continue;
    const std::vector<double> numbers = numbersOf(list);
    if (numbers.size() == form.count)
      if (const std::optional<Region> region = makeRegion(form.shape, numbers)) return *region;
    refuse(text, fmt::format("{}, {}", exampleOf(form), form.rule));
  }
  std::string forms;
  for (const RegionForm& form : kRegionForms) forms += exampleOf(form) + ", ";
  refuse(text, forms + "or vertices=FILE.csv");
}

// makeRegion's.
std::vector<double> numbersOf(const Region& r) {
  std::vector<double> out;
  const auto add = [&](const Eigen::Vector3d& v) { out.insert(out.end(), v.begin(), v.end()); };
  switch (r.shape) {
    case Region::Shape::box:
      add(r.box.min());
      add(r.box.max());
      break;
    case Region::Shape::ball:
      add(r.centre);
      out.push_back(r.radius);
      break;
    case Region::Shape::halfSpace:
      add(r.normal);
      out.push_back(r.distance);
      break;
  }
  return out;
}

}  // namespace

std::string regionText(const Region& region) {
  const auto form = std::find_if(kRegionForms.begin(), kRegionForms.end(),
                                 [&](const RegionForm& f) { return f.shape == region.shape; });
  std::string list;
  for (const double number : numbersOf(region)) list += fmt::format("{}{}", list.empty() ? "" : ",", number);
  return fmt::format("{}={}", form->word, list);
}

std::string vertexFileOf(const std::string& text) {
  constexpr std::string_view kind = "vertices=";
  return text.starts_with(kind) ? text.substr(kind.size()) : "";
}

HeldRegion parseHeldRegion(const std::string& text, const SoftBodyModel& model) {
  const std::size_t equals = text.find('=');
  const std::string kind = text.substr(0, equals), value = equals == std::string::npos ? "" : text.substr(equals + 1);
  HeldRegion held;
  held.text = text;
  if (const std::string file = vertexFileOf(text); !file.empty()) {
    held.text = "vertices=" + std::filesystem::path(file).filename().string();
    held.nodes = readVertices(file, model);
    return held;
  }
  const Region region = regionOf(text, kind, value);
  held.nodes = nodesInRegion(model, region);
  held.isSpace = true;
  if (held.nodes.empty()) throw std::runtime_error(fmt::format("--fix {} holds no node of the surface", text));
  return held;
}

}  // namespace medulla
