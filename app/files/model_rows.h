#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/xml_element.h"

// The long arrays of a model file: an element each, a line of numbers per row.
namespace medulla {

// Appends numbers, vectors and arrays to the line that `out` ends with.
template <typename T>
void putValue(std::string& out, const T& value) {
  if constexpr (std::is_arithmetic_v<T>) {
    if (out.back() != '\n') out += ' ';
    appendNumber(out, value);
  } else {
    for (long k = 0; k < static_cast<long>(value.size()); ++k) putValue(out, value.data()[k]);
  }
}

template <typename... T>
void put(std::string& out, const T&... values) {
  (putValue(out, values), ...);
}

// `attributes`, if any: ` name="value"` each.
template <typename Row>
void putRows(std::string& out, const char* name, std::size_t rows, const Row& putRow,
             const std::string& attributes = "") {
  out += std::string("  <") + name + " rows=\"" + std::to_string(rows) + "\"" + attributes + ">\n";
  for (std::size_t k = 0; k < rows; ++k) {
    putRow(k);
    out += '\n';
  }
  out += std::string("  </") + name + ">\n";
}

template <typename T>
void putArray(std::string& out, const char* name, const std::vector<T>& values) {
  putRows(out, name, values.size(), [&](std::size_t k) { put(out, values[k]); });
}

// The numbers of one element's text in order, row by row, with the line for complaints.
class Rows {
 public:
  Rows(const std::string& path, const XmlElement& root, const std::string& name) : Rows(path, onlyChild(root, name)) {}
  Rows(const std::string& path, const XmlElement& element) : path_(path), element_(element) {
    rest_ = element_.text;
    line_ = std::max(element_.textLine, element_.place.line);
    rows_ = readInteger(element_, "rows", 0, kNotNegative);
  }

  // Calls readRow() for every row; afterwards no text may be left.
  template <typename Row>
  void forEach(const Row& readRow) {
    for (int k = 0; k < rows_; ++k) readRow();
    skipSpace();
    require(rest_.empty(), "more numbers than its rows hold");
  }

  // Fills numbers, vectors and arrays of fixed size.
  template <typename... T>
  void get(T&... values) {
    (getValue(values), ...);
  }

  int index(std::size_t size, int lowest = 0) {
    const int value = next<int>();
    require(value >= lowest && value < static_cast<long>(size), "an index out of range");
    return value;
  }

  template <std::size_t N>
  std::array<int, N> indices(std::size_t size) {
    std::array<int, N> out;
    for (int& i : out) i = index(size);
    for (std::size_t k = 0; k < N; ++k) require(out[k] != out[(k + 1) % N], "the same index twice");
    return out;
  }

  // Of a cell: m3, m5 about its centroid.
  void requireMoments(double volume, const Eigen::Matrix3d& second) const {
    require(volume > 0, "a volume that is not positive");
    require(second.isApprox(second.transpose(), 1e-9), "a second moment that is not symmetric");
    require(second.llt().info() == Eigen::Success, "a second moment that is not positive definite");
  }

  void requireAscending(std::span<const int> numbers, const char* message) const {
    require(std::adjacent_find(numbers.begin(), numbers.end(), std::greater_equal<>()) == numbers.end(), message);
  }

  void require(bool condition, const char* message) const {
    if (!condition) throw inputError(path_, line_, "<" + element_.name + ">: " + message);
  }

 private:
  static bool isSpace(char c) { return c == ' ' || c == '\n' || c == '\t'; }

  void skipSpace() {
    std::size_t k = 0;
    for (; k < rest_.size() && isSpace(rest_[k]); ++k) line_ += rest_[k] == '\n';
    rest_.remove_prefix(k);
  }

  template <typename T>
  T next() {
    skipSpace();
    std::size_t length = 0;  // a plain loop: find_first_of() took a quarter of the whole reading time
    while (length < rest_.size() && !isSpace(rest_[length])) ++length;
    require(length > 0, "fewer numbers than its rows hold");
    const std::optional<T> value = parseNumber<T>(rest_.substr(0, length));
    require(value.has_value(), std::is_integral_v<T> ? "expected an integer" : "expected a finite number");
    rest_.remove_prefix(length);
    return *value;
  }

  template <typename T>
  void getValue(T& value) {
    if constexpr (std::is_arithmetic_v<T>)
      value = next<T>();
    else
      for (long k = 0; k < static_cast<long>(value.size()); ++k) getValue(value.data()[k]);
  }

  const std::string& path_;
  const XmlElement& element_;
  std::string_view rest_;
  int line_ = 0, rows_ = 0;
};

}  // namespace medulla
