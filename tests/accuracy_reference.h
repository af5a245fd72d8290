#pragma once

#include <Eigen/Core>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// Readers of tests/accuracy/results: what FEM found (tests/accuracy/README.md).
namespace medulla::reference {

using Eigen::Vector3d;

inline std::string folder() {
  return MEDULLA_SOURCE_DIR "/tests/accuracy/results/";
}

// One result file: header lines "# key value" and rows of integers.
struct Result {
  std::string path;
  std::map<std::string, std::string> header;
  std::vector<std::vector<double>> rows;

  const std::string& text(const std::string& key) const {
    const auto found = header.find(key);
    if (found == header.end()) throw std::runtime_error(path + ": no header line \"" + key + '"');
    return found->second;
  }
  // The leading numbers of a header line; what follows them is the unit or a remark.
  std::vector<double> numbers(const std::string& key) const {
    std::istringstream words(text(key));
    std::vector<double> values;
    for (double value; words >> value;) values.push_back(value);
    return values;
  }
  double number(const std::string& key) const { return numbers(key).at(0); }
  Vector3d vector(const std::string& key) const {
    const std::vector<double> v = numbers(key);
    return {v.at(0), v.at(1), v.at(2)};
  }
  // First word: a file's name.
  std::string word(const std::string& key) const { return text(key).substr(0, text(key).find(' ')); }

  // Three columns of every row from `column` on, times the unit of `unit`: displacements in metres, or mode shapes.
  std::vector<Vector3d> vectors(double unit, int column = 0) const {
    std::vector<Vector3d> v;
    for (const std::vector<double>& row : rows) {
      v.push_back(unit * Vector3d(row.at(column), row.at(column + 1), row.at(column + 2)));
    }
    return v;
  }
};

inline std::ifstream open(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  return file;
}

inline Result readResult(const std::string& name) {
  Result result;
  result.path = folder() + name + ".txt";
  std::ifstream file = open(result.path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("# ")) {
      const std::size_t space = line.find(' ', 2);
      result.header[line.substr(2, space - 2)] = line.substr(space + 1);
      continue;
    }
    std::istringstream words(line);
    std::vector<double>& row = result.rows.emplace_back();
    for (double value; words >> value;) row.push_back(value);
    if (!words.eof()) throw std::runtime_error(result.path + ": a row with more than numbers");
  }
  return result;
}

// Rows of a CSV file below its header line.
inline std::vector<std::vector<double>> readCsv(const std::string& name) {
  std::ifstream file = open(folder() + name);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream words(line);
    std::vector<double>& row = rows.emplace_back();
    for (double value; words >> value;) row.push_back(value);
  }
  return rows;
}

// Vertices held, 0-based, of the mesh that the result names.
inline std::vector<int> readFix(const Result& result) {
  std::vector<int> vertices;
  for (const auto& row : readCsv(result.word("fix"))) vertices.push_back(static_cast<int>(row.at(0)));
  return vertices;
}

// Dead forces on vertices, N.
inline std::vector<std::pair<int, Vector3d>> readLoad(const Result& result) {
  std::vector<std::pair<int, Vector3d>> forces;
  for (const auto& row : readCsv(result.word("load"))) {
    forces.emplace_back(static_cast<int>(row.at(0)), Vector3d(row.at(1), row.at(2), row.at(3)));
  }
  return forces;
}

}  // namespace medulla::reference
