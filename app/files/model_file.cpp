#include "app/files/model_file.h"

#include <cassert>
#include <string_view>

#include "app/files/input_error.h"
#include "app/files/model_check.h"
#include "app/files/number_text.h"
#include "app/files/output_file.h"
#include "app/files/xml_element.h"

// The arrays of a model in the order of SoftBodyModel, one element each, one row of numbers per entry and line. Writer
// and reader stand side by side, so that their columns can be compared.
namespace medulla {

namespace {

constexpr const char* formatVersion = "1";

const XmlRules& modelRules() {
  static const XmlRules rules = [] {
    const std::vector<std::string> arrays = {"input_vertices", "nodes",          "triangles",      "edges",
                                             "spheres",        "links",          "attachments",    "buckets",
                                             "skeleton_nodes", "skeleton_links", "render_vertices", "render_stencils",
                                             "render_triangles"};
    XmlRules out = {{"model", {"version", "name", "mesh_hash", "settings"}, {}, {}}};
    for (const std::string& name : arrays) {
      out.front().children.push_back({name, 1, 1});
      out.push_back({name, {"rows"}, {}, {}, true});
    }
    return out;
  }();
  return rules;
}

// ---- writing ----

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\n': out += "&#10;"; break;
      case '\r': out += "&#13;"; break;
      case '\t': out += "&#9;"; break;
      default: out += c;
    }
  }
  return out;
}

template <typename T>
void put(std::string& row, const T& value) {
  if constexpr (std::is_arithmetic_v<T>) {
    if (row.back() != '\n') row += ' ';
    appendNumber(row, value);
  } else if constexpr (requires { value.data(); }) {  // Eigen and std::array, column by column
    for (long k = 0; k < static_cast<long>(value.size()); ++k) put(row, value.data()[k]);
  }
}

template <typename Row>
void putArray(std::string& out, const char* name, std::size_t rows, const Row& row) {
  out += std::string("  <") + name + " rows=\"" + std::to_string(rows) + "\">\n";
  for (std::size_t k = 0; k < rows; ++k) {
    row(k);
    out += '\n';
  }
  out += std::string("  </") + name + ">\n";
}

template <typename T>
void putArray(std::string& out, const char* name, const std::vector<T>& values) {
  putArray(out, name, values.size(), [&](std::size_t k) { put(out, values[k]); });
}

void putSkeletonOfSpheres(std::string& out, const SoftBodyModel& model) {
  putArray(out, "spheres", model.spheres.size(), [&](std::size_t k) {
    const FillingSphere& s = model.spheres[k];
    put(out, s.restBallCentre), put(out, s.radius), put(out, s.restFrame), put(out, s.volume), put(out, s.secondMoment);
  });
  putArray(out, "links", model.links.size(), [&](std::size_t k) {
    const ElasticLink& l = model.links[k];
    put(out, l.sphere0), put(out, l.sphere1), put(out, l.area), put(out, l.bendingMomentU);
    put(out, l.bendingMomentV), put(out, l.torsionConstant), put(out, l.restU);
  });
  putArray(out, "attachments", model.attachments.size(), [&](std::size_t k) {
    const Attachment& a = model.attachments[k];
    put(out, static_cast<int>(a.onLink)), put(out, a.host), put(out, a.along), put(out, a.restOffset);
    put(out, a.area), put(out, a.volume);
  });
  putArray(out, "buckets", model.buckets.size(), [&](std::size_t k) {
    put(out, static_cast<int>(model.buckets[k].size()));
    for (const int triangle : model.buckets[k]) put(out, triangle);
  });
}

void putRenderSurface(std::string& out, const RenderSurface& surface) {
  putArray(out, "render_vertices", surface.restPosition.size(), [&](std::size_t k) {
    put(out, surface.first[k + 1] - surface.first[k]), put(out, surface.offset[k]), put(out, surface.restPosition[k]);
  });
  putArray(out, "render_stencils", surface.node.size(), [&](std::size_t k) {
    put(out, surface.node[k]), put(out, surface.weight[k]), put(out, surface.tangent0[k]), put(out, surface.tangent1[k]);
  });
  putArray(out, "render_triangles", surface.triangles);
}

// ---- reading ----

// The numbers of one element's text in order, row by row, with the line for complaints.
class Rows {
 public:
  Rows(const std::string& path, const XmlElement& element)
      : path_(path), element_(element), rest_(element.text), line_(element.textLine) {
    rows_ = readInteger(element, "rows", 0, notNegative);
  }

  // Calls row(k) for every row; afterwards nothing may be left.
  template <typename Row>
  void read(const Row& row) {
    for (int k = 0; k < rows_; ++k) row(k);
    if (skipSpace(), !rest_.empty()) fail("expected " + std::to_string(rows_) + " rows and no more");
  }

  template <typename T>
  void get(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      value = next<T>();
    } else {
      for (long k = 0; k < static_cast<long>(value.size()); ++k) get(value.data()[k]);
    }
  }

  int index(std::size_t size, int lowest = 0) {
    const int value = next<int>();
    require(value >= lowest && value < static_cast<long>(size), "an index out of range");
    return value;
  }

  void require(bool condition, const char* message) const {
    if (!condition) fail(message);
  }

 private:
  void skipSpace() {
    std::size_t k = 0;
    for (; k < rest_.size() && (rest_[k] == ' ' || rest_[k] == '\n' || rest_[k] == '\t' || rest_[k] == '\r'); ++k) {
      line_ += rest_[k] == '\n';
    }
    rest_.remove_prefix(k);
  }

  template <typename T>
  T next() {
    skipSpace();
    const std::size_t length = std::min(rest_.find_first_of(" \n\t\r"), rest_.size());
    if (length == 0) fail("the text ends early, expected " + std::to_string(rows_) + " rows");
    const std::optional<T> value = parseNumber<T>(rest_.substr(0, length));
    if (!value) fail(std::is_integral_v<T> ? "expected an integer" : "expected a finite number");
    rest_.remove_prefix(length);
    return *value;
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw inputError(path_, std::max(line_, element_.line), "<" + element_.name + ">: " + message);
  }

  const std::string& path_;
  const XmlElement& element_;
  std::string_view rest_;
  int line_;
  int rows_;
};

template <typename T>
std::vector<T> readArray(Rows rows) {
  std::vector<T> out;
  rows.read([&](int) { rows.get(out.emplace_back()); });
  return out;
}

}  // namespace

}  // namespace medulla
