#include "app/files/ply_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/polygons.h"
#include "app/files/text.h"
#include "app/files/text_lines.h"

namespace medulla {

namespace {

enum class Form { text, littleEndian, bigEndian };
enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class Use { none, x, y, z, corners };

struct Property {
  Scalar type = Scalar::int8;
  std::optional<Scalar> count;  // a list has one
  Use use = Use::none;
};

struct Element {
  std::string_view name;  // in the file
  long long count = 0;
  std::vector<Property> properties;
};

struct Header {
  Form form = Form::text;
  std::vector<Element> elements;
  int lines = 0;
  std::string_view behind;  // the rest of the file

  const Element* find(std::string_view name) const {
    const auto found = std::find_if(elements.begin(), elements.end(), [&](const Element& e) { return e.name == name; });
    return found == elements.end() ? nullptr : &*found;
  }
};

std::optional<Scalar> scalarOf(std::string_view word) {
  struct Name {
    const char *old, *sized;
  };
  constexpr Name names[] = {{"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
                            {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
  for (int k = 0; k < 8; ++k)
    if (word == names[k].old || word == names[k].sized) return static_cast<Scalar>(k);
  return std::nullopt;
}

std::size_t sizeOf(Scalar type) {
  constexpr std::size_t bytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return bytes[static_cast<int>(type)];
}

// ---- Header ----------------------------------------------------------------------------------------------

Use useOf(const Element& element, const Property& property, std::string_view name) {
  if (element.name == "vertex" && !property.count)
    return name == "x" ? Use::x : name == "y" ? Use::y : name == "z" ? Use::z : Use::none;
  const bool corners = name == "vertex_indices" || name == "vertex_index";
  return element.name == "face" && property.count && corners ? Use::corners : Use::none;
}

// Empty where the words are none.
std::optional<Property> propertyOf(const Element& element, std::string_view words) {
  std::string_view word = takeWord(words);
  Property out;
  if (word == "list") {
    out.count = scalarOf(takeWord(words));
    if (!out.count || *out.count >= Scalar::float32) return std::nullopt;
    word = takeWord(words);
  }
  const std::optional<Scalar> type = scalarOf(word);
  const std::string_view name = takeWord(words);
  if (!type || name.empty() || !takeWord(words).empty()) return std::nullopt;
  out.type = *type;
  out.use = useOf(element, out, name);
  return out;
}

std::optional<Form> formOf(std::string_view words) {
  const std::string_view form = takeWord(words);
  if (takeWord(words) != "1.0") return std::nullopt;
  if (form == "ascii") return Form::text;
  if (form == "binary_little_endian") return Form::littleEndian;
  if (form == "binary_big_endian") return Form::bigEndian;
  return std::nullopt;
}

bool has(const Element* element, Use use) {
  return element && std::any_of(element->properties.begin(), element->properties.end(),
                                [use](const Property& p) { return p.use == use; });
}

Header readHeader(std::string_view bytes, const std::string& name) {
  Header header;
  bool knowsForm = false;
  const auto fail = [&](const std::string& message) { throw inputError(name, header.lines, message); };
  for (std::string_view rest = bytes; !rest.empty();) {
    std::string_view words = takeLine(rest);
    ++header.lines;
    const std::string_view word = takeWord(words);
    if (word.empty() || word == "ply" || word == "comment" || word == "obj_info") continue;
    if (word == "end_header") {
      if (!knowsForm) fail("the header ends without a format");
      header.behind = rest;
      return header;
    }
    if (word == "format") {
      const std::optional<Form> form = formOf(words);
      if (!form) fail("expected format ascii 1.0, binary_little_endian 1.0 or binary_big_endian 1.0");
      header.form = *form;
      knowsForm = true;
    } else if (word == "element") {
      const std::string_view element = takeWord(words);
      const std::optional<int> count = parseNumber<int>(takeWord(words));
      if (!count || *count < 0)
        fail(fmt::format("expected element NAME COUNT, a count from 0 to {}", std::numeric_limits<int>::max()));
      if (header.find(element)) fail(fmt::format("element {} stands twice", inQuotes(element)));
      header.elements.push_back({element, *count, {}});
    } else if (word == "property" && !header.elements.empty()) {
      const std::optional<Property> property = propertyOf(header.elements.back(), words);
      if (!property) fail("expected property TYPE NAME or property list TYPE TYPE NAME, the first type a whole number");
      if (property->use != Use::none && has(&header.elements.back(), property->use))
        fail("a property of this use stands twice in its element");
      header.elements.back().properties.push_back(*property);
    } else {
      fail(fmt::format("{} is no line of a PLY header, expected element, property or end_header", inQuotes(word)));
    }
  }
  throw inputError(name, header.lines, "the file ends within the header");
}

// Counts are compared with what is there before anything is allocated for them: the shortest number takes a byte of
// text and one that ends it, and the shortest list has no entry.
void requireEnough(const Header& header, const std::string& name) {
  std::size_t left = header.behind.size() + 1;  // the last number of a text may end with the file
  for (const Element& element : header.elements) {
    std::size_t least = 0;
    for (const Property& p : element.properties)
      least += header.form == Form::text ? 2 : sizeOf(p.count.value_or(p.type));
    const std::size_t count = static_cast<std::size_t>(element.count);
    if (count == 0) continue;
    if (least == 0) throw inputError(name, 0, fmt::format("element {} has no property", inQuotes(element.name)));
    if (count > left / least)
      throw inputError(name, 0,
                       fmt::format("the file ends too early: its header counts {} elements {}, more than the {} bytes "
                                   "behind it hold",
                                   count, inQuotes(element.name), header.behind.size()));
    left -= count * least;
  }
}

// ---- Body ------------------------------------------------------------------------------------------------

// What stands behind the header, number by number; a row is what belongs to one element.
class Values {
 public:
  Values(const Header& header, std::string name)
      : rest_(header.behind), form_(header.form), name_(std::move(name)), line_(header.lines) {}

  void beginRow(const Element& element, long long number) {
    element_ = &element;
    number_ = number;
    while (form_ == Form::text && isBlank(row_)) {
      if (rest_.empty()) failAtEnd();
      row_ = takeLine(rest_);
      ++line_;
    }
  }
  void endRow() {
    if (form_ == Form::text && !isBlank(row_))
      fail(fmt::format("more numbers than a {} has", inQuotes(element_->name)));
    if (form_ == Form::text) row_ = {};
  }
  // NaN where a word is no number: who needs it complains.
  double next(Scalar type) {
    if (form_ != Form::text) return nextBinary(type);
    const std::string_view word = takeWord(row_);
    if (word.empty()) fail(fmt::format("fewer numbers than a {} has", inQuotes(element_->name)));
    return parseNumber<double>(word).value_or(std::numeric_limits<double>::quiet_NaN());
  }
  // From 0 to `last`.
  long long whole(Scalar type, long long last, const char* what) {
    const double value = next(type);
    if (!(value >= 0 && value <= static_cast<double>(last)) || value != std::floor(value))
      fail(fmt::format("{} {} has {} {}, expected a whole number from 0 to {}", inQuotes(element_->name), number_, what,
                       value, last));
    return static_cast<long long>(value);
  }
  // As a list may be that the rest of the file holds.
  long long listLength(const Property& list) {
    const long long length = whole(*list.count, std::numeric_limits<std::uint32_t>::max(), "a list of length");
    if (form_ != Form::text && static_cast<std::size_t>(length) > rest_.size() / sizeOf(list.type)) failAtEnd();
    return length;
  }
  void requireEnd() {
    while (form_ == Form::text && isBlank(row_) && !rest_.empty()) {
      row_ = takeLine(rest_);
      ++line_;
    }
    if (!isBlank(row_) || !rest_.empty()) fail("expected the end of the file after what the header counts");
  }
  [[noreturn]] void fail(const std::string& message) const {
    throw inputError(name_, form_ == Form::text ? line_ : 0, message);
  }

 private:
  static bool isBlank(std::string_view row) { return trimmed(row).empty(); }

  [[noreturn]] void failAtEnd() const {
    fail(fmt::format("the file ends after {} of {} elements {}", number_, element_->count, inQuotes(element_->name)));
  }

  template <typename T>
  double take() {
    static_assert(std::endian::native == std::endian::little);
    if (rest_.size() < sizeof(T)) failAtEnd();
    std::array<char, sizeof(T)> bytes;
    std::copy_n(rest_.begin(), sizeof(T), bytes.begin());
    if (form_ == Form::bigEndian) std::reverse(bytes.begin(), bytes.end());
    rest_.remove_prefix(sizeof(T));
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  double nextBinary(Scalar type) {
    switch (type) {
      case Scalar::int8:
        return take<std::int8_t>();
      case Scalar::uint8:
        return take<std::uint8_t>();
      case Scalar::int16:
        return take<std::int16_t>();
      case Scalar::uint16:
        return take<std::uint16_t>();
      case Scalar::int32:
        return take<std::int32_t>();
      case Scalar::uint32:
        return take<std::uint32_t>();
      case Scalar::float32:
        return take<float>();
      case Scalar::float64:
        return take<double>();
    }
    return 0;
  }

  std::string_view rest_, row_;
  Form form_;
  std::string name_;
  int line_;
  const Element* element_ = nullptr;
  long long number_ = 0;
};

struct PlyRow {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<int> corners;
};

void readRow(Values& values, const Element& element, long long vertices, PlyRow& row) {
  row.corners.clear();
  for (const Property& p : element.properties) {
    const long long length = p.count ? values.listLength(p) : 1;
    for (long long k = 0; k < length; ++k)
      if (p.use == Use::corners)
        row.corners.push_back(static_cast<int>(values.whole(p.type, vertices - 1, "a corner at vertex")));
      else if (p.use == Use::none)
        values.next(p.type);
      else
        row.position[static_cast<int>(p.use) - static_cast<int>(Use::x)] = values.next(p.type);
  }
}

void readElements(Values& values, const Element& element, long long vertices, TriangleMesh& mesh, Polygons& polygons) {
  PlyRow row;
  const bool isVertex = element.name == "vertex", isFace = has(&element, Use::corners);
  for (long long k = 0; k < element.count; ++k) {
    values.beginRow(element, k);
    readRow(values, element, vertices, row);
    values.endRow();
    if (isVertex && !row.position.allFinite()) values.fail(fmt::format("vertex {} is not finite", k));
    if (isVertex) mesh.vertices.push_back(row.position);
    if (!isFace) continue;
    if (row.corners.size() < 3)
      values.fail(fmt::format("face {} has {} corners, expected at least 3", k, row.corners.size()));
    polygons.add(row.corners, mesh);
  }
}

}  // namespace

TriangleMesh parsePly(std::string_view bytes, const std::string& name) {
  std::string_view rest = bytes, first = takeLine(rest);
  if (takeWord(first) != "ply") throw inputError(name, 0, "is no PLY file: expected one that begins with the line ply");
  const Header header = readHeader(bytes, name);
  const Element* vertex = header.find("vertex");
  if (!has(vertex, Use::x) || !has(vertex, Use::y) || !has(vertex, Use::z))
    throw inputError(name, 0, "expected a header with an element vertex that has the properties x, y and z");
  if (vertex->count == 0) throw inputError(name, 0, "no vertices in this PLY file");
  if (!has(header.find("face"), Use::corners))
    throw inputError(name, 0, "no triangles: expected a header with an element face that has a list vertex_indices");
  requireEnough(header, name);
  TriangleMesh mesh;
  Polygons polygons;
  Values values(header, name);
  for (const Element& element : header.elements) readElements(values, element, vertex->count, mesh, polygons);
  values.requireEnd();
  if (mesh.triangles.empty()) throw inputError(name, 0, "no triangles in this PLY file");
  polygons.cutConcave(name, mesh);
  return mesh;
}

}  // namespace medulla
