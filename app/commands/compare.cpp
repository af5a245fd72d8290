#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/commands/commands.h"
#include "app/files/log_table.h"
#include "app/files/state_cache.h"
#include "app/files/text_file.h"
#include "app/interrupt.h"
#include "app/standard_streams.h"
#include "app/tool_fields.h"

namespace medulla {

namespace {

// Largest magnitude of each column in either log: what a tolerance is a share of. Columns have units of their own, and
// values that pass through zero have no relative error.
std::vector<double> scales(const LogTable& a, const LogTable& b) {
  std::vector<double> out(a.columns.size(), 0);
  for (const LogTable* table : {&a, &b})
    for (const std::vector<double>& row : table->value)
      for (std::size_t k = 0; k < out.size(); ++k) out[k] = std::max(out[k], std::abs(row[k]));
  return out;
}

struct Cell {
  std::size_t row, column;
};

std::optional<Cell> firstDifference(const LogTable& a, const LogTable& b, double tolerance) {
  const std::vector<double> scale = scales(a, b);
  for (std::size_t r = 0; r < std::min(a.value.size(), b.value.size()); ++r) {
    for (std::size_t k = 0; k < a.columns.size(); ++k) {
      const bool differs =
          tolerance > 0 ? std::abs(a.value[r][k] - b.value[r][k]) > tolerance * scale[k] : a.text[r][k] != b.text[r][k];
      if (differs) return Cell{r, k};
    }
  }
  return std::nullopt;
}

int differing(std::vector<Result> results) {
  results.insert(results.begin(), {"equal", "no", ""});
  printResults(results);
  return 3;
}

// What a cache says of every picture, as columns.
void appendNames(std::vector<std::string>& out, const std::string& start, const char* letters) {
  for (; *letters; ++letters) out.push_back(start + "." + *letters);
}

std::vector<std::string> fieldsOf(const CacheLayout& layout) {
  std::vector<std::string> out{"t"};
  for (const CacheLayout::Body& body : layout.bodies) {
    for (int i = 0; i < body.spheres; ++i) {
      appendNames(out, fmt::format("{}.sphere.{}.position", body.name, i), "xyz");
      appendNames(out, fmt::format("{}.sphere.{}.orientation", body.name, i), "wxyz");
    }
    for (int i = 0; i < body.nodes; ++i) appendNames(out, fmt::format("{}.node.{}", body.name, i), "xyz");
  }
  const ToolSample input;
  const ToolState state;
  for (const std::string& tool : layout.tools)
    visitToolNumbers(input, state,
                     [&](const std::string& what, double) { out.push_back(fmt::format("{}.{}", tool, what)); });
  return out;
}

// In the order of fieldsOf().
void valuesOf(const PictureState& state, std::vector<double>& out) {
  out.assign(1, state.time);
  const auto add = [&out](const Eigen::Vector3d& v) { out.insert(out.end(), {v.x(), v.y(), v.z()}); };
  const auto turn = [&out](const Eigen::Quaterniond& q) { out.insert(out.end(), {q.w(), q.x(), q.y(), q.z()}); };
  for (const BodyFrame& body : state.frame.bodies) {
    for (const SpherePose& sphere : body.spheres) {
      add(sphere.position);
      turn(sphere.worldFromSphere);
    }
    for (const Eigen::Vector3d& node : body.nodes) add(node);
  }
  for (std::size_t k = 0; k < state.tools.size(); ++k)
    visitToolNumbers(state.inputs[k], state.tools[k], [&out](const std::string&, double x) { out.push_back(x); });
}

// Components of one vector share a scale: one that stays near zero has no meaning of its own.
std::vector<double> scales(CacheReader& a, CacheReader& b, const std::vector<std::string>& fields) {
  std::vector<double> out, values;
  PictureState state;
  for (CacheReader* cache : {&a, &b})
    for (int n = 0; n < cache->pictures(); ++n) {
      checkInterrupt();
      cache->read(n, state);
      valuesOf(state, values);
      out.resize(values.size());
      for (std::size_t k = 0; k < out.size(); ++k) out[k] = std::max(out[k], std::abs(values[k]));
    }
  const auto vectorOf = [&fields](std::size_t k) { return fields[k].substr(0, fields[k].size() - 2); };
  const auto component = [&fields](std::size_t k) {
    return fields[k].size() > 2 && fields[k][fields[k].size() - 2] == '.';
  };
  for (std::size_t k = 0, end = 0; k < out.size(); k = end) {
    for (end = k + 1; component(k) && end < out.size() && component(end) && vectorOf(end) == vectorOf(k);) ++end;
    std::fill(out.begin() + std::ptrdiff_t(k), out.begin() + std::ptrdiff_t(end),
              *std::max_element(out.begin() + std::ptrdiff_t(k), out.begin() + std::ptrdiff_t(end)));
  }
  return out;
}

std::string describe(const CacheLayout& layout) {
  std::string out = fmt::format("{} pictures per second", layout.fps);
  for (const CacheLayout::Body& body : layout.bodies)
    out += fmt::format(", {} of {} spheres and {} nodes", body.name, body.spheres, body.nodes);
  for (const std::string& tool : layout.tools) out += ", " + tool;
  return out;
}

std::vector<Result> hashes(std::uint64_t a, std::uint64_t b) {
  return {{"field", "state_hash", ""}, {"a", fmt::format("{:016x}", a), ""}, {"b", fmt::format("{:016x}", b), ""}};
}

int compareCaches(const CompareOptions& options) {
  CacheReader a(options.a), b(options.b);
  const CacheLayout &ofA = a.layout(), &ofB = b.layout();
  if (ofA.fps != ofB.fps || ofA.bodies != ofB.bodies || ofA.tools != ofB.tools)
    return differing({{"a", describe(ofA), ""}, {"b", describe(ofB), ""}});
  const std::vector<std::string> fields = fieldsOf(a.layout());
  const std::vector<double> scale = options.tolerance > 0 ? scales(a, b, fields) : std::vector<double>();
  PictureState state;
  std::vector<double> inA, inB;
  std::vector<Result> unseen;  // the first difference of what no picture shows, such as speeds
  for (int n = 0; n < std::min(a.pictures(), b.pictures()); ++n) {
    checkInterrupt();
    const std::uint64_t hashA = a.read(n, state);
    valuesOf(state, inA);
    const std::uint64_t hashB = b.read(n, state);
    valuesOf(state, inB);
    const auto difference = [&](std::vector<Result> field) {
      field.insert(field.begin(), {{"picture", fmt::format("{}", n), ""}, {"t", fmt::format("{}", inA[0]), "s"}});
      return field;
    };
    for (std::size_t k = 0; k < inA.size(); ++k)
      if (options.tolerance > 0 ? std::abs(inA[k] - inB[k]) > options.tolerance * scale[k] : inA[k] != inB[k])
        return differing(difference(
            {{"field", fields[k], ""}, {"a", fmt::format("{}", inA[k]), ""}, {"b", fmt::format("{}", inB[k]), ""}}));
    if (options.tolerance == 0 && hashA != hashB && unseen.empty()) unseen = difference(hashes(hashA, hashB));
  }
  if (a.pictures() != b.pictures())
    return differing(
        {{"pictures_a", fmt::format("{}", a.pictures()), ""}, {"pictures_b", fmt::format("{}", b.pictures()), ""}});
  if (unseen.empty() && options.tolerance == 0 && a.finalHash() != b.finalHash())
    unseen = hashes(a.finalHash(), b.finalHash());
  if (!unseen.empty()) return differing(unseen);
  printResults({{"equal", "yes", ""}, {"pictures", fmt::format("{}", a.pictures()), ""}});
  return 0;
}

void noteCut(const LogTable& log) {
  if (log.isCut)
    tell("note: {} ends in the midst of row {}: only the rows before it are compared\n", log.path,
         log.value.size() + 1);
}

int compareLogs(const CompareOptions& options) {
  const LogTable a = readLog(options.a), b = readLog(options.b);
  noteCut(a);
  noteCut(b);
  const auto [inA, inB] = std::mismatch(a.columns.begin(), a.columns.end(), b.columns.begin(), b.columns.end());
  if (inA != a.columns.end() || inB != b.columns.end())
    return differing({{"column", fmt::format("{}", inA - a.columns.begin() + 1), ""},
                      {"a", inA != a.columns.end() ? *inA : "none", ""},
                      {"b", inB != b.columns.end() ? *inB : "none", ""}});
  if (const std::optional<Cell> cell = firstDifference(a, b, options.tolerance)) {
    const auto [row, column] = *cell;
    return differing({{"row", fmt::format("{}", row + 1), ""},
                      {"t", std::string(a.text[row][0]), "s"},
                      {"field", a.columns[column], ""},
                      {"a", std::string(a.text[row][column]), ""},
                      {"b", std::string(b.text[row][column]), ""},
                      {"line_a", fmt::format("{}", a.lines[row]), ""},
                      {"line_b", fmt::format("{}", b.lines[row]), ""}});
  }
  if (a.value.size() != b.value.size() || a.isCut || b.isCut)
    return differing(
        {{"rows_a", fmt::format("{}", a.value.size()), ""}, {"rows_b", fmt::format("{}", b.value.size()), ""}});
  printResults({{"equal", "yes", ""}, {"rows", fmt::format("{}", a.value.size()), ""}});
  return 0;
}

}  // namespace

int runCompare(const CompareOptions& options) {
  const bool cacheA = isCache(options.a), cacheB = isCache(options.b);
  if (cacheA != cacheB) {
    const std::string &cache = cacheA ? options.a : options.b, &other = cacheA ? options.b : options.a;
    readBytes(other);  // says so where it cannot be read
    throw std::runtime_error(fmt::format("{} is a state cache, {} is none: expected two of a kind", cache, other));
  }
  return cacheA ? compareCaches(options) : compareLogs(options);
}

}  // namespace medulla
