#include "app/files/vertex_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "app/files/csv_rows.h"
#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/files/xml_element.h"
#include "physics/sort_unique.h"

namespace medulla {

namespace {

constexpr std::array<std::string_view, 1> kVertexColumns = {"vertex"};
constexpr std::array<std::string_view, 4> kForceColumns = {"vertex", "fx[N]", "fy[N]", "fz[N]"};

// A header may leave the units away.
bool isHeader(std::span<const std::string_view> cells, std::span<const std::string_view> columns) {
  return std::equal(cells.begin(), cells.end(), columns.begin(), columns.end(),
                    [](std::string_view cell, std::string_view column) {
                      return cell == column || cell == column.substr(0, column.find('['));
                    });
}

// Calls `row` for every row but a header, with the vertex in its first column and its node.
template <typename Row>
void forEachVertex(std::string_view text, const std::string& name, const SoftBodyModel& model,
                   std::span<const std::string_view> columns, const Row& row) {
  if (model.nodeOfInputVertex.empty())
    throw inputError(name, 0, "the model does not say which vertices of its mesh its nodes are: build it anew");
  CsvRows rows(text, name);
  const std::string expected = joined(columns, ",");
  bool first = true, any = false;
  for (; rows.next(); first = false) {
    if (first) rows.requireCommas();
    if (first && isHeader(rows.cells(), columns)) continue;
    if (first && !parseNumber<double>(rows.cells()[0]))
      rows.fail(fmt::format("the first row is {}, expected a header {} or numbers", inQuotes(joined(rows.cells(), ",")),
                            expected));
    rows.requireCells(columns.size(), expected);
    const int vertex = rows.index(0, columns[0], model.nodeOfInputVertex.size());
    const int node = model.nodeOfInputVertex[vertex];
    if (node < 0) rows.fail(fmt::format("vertex {} is none of the surface: repair dropped it from the mesh", vertex));
    row(rows, vertex, node);
    any = true;
  }
  if (!any) throw inputError(name, 0, fmt::format("no rows, expected at least one of {}", expected));
}

}  // namespace

std::vector<int> parseVertices(std::string_view text, const std::string& name, const SoftBodyModel& model) {
  std::vector<int> nodes;
  forEachVertex(text, name, model, kVertexColumns, [&](const CsvRows&, int, int node) { nodes.push_back(node); });
  sortUnique(nodes);
  return nodes;
}

std::vector<int> readVertices(const std::string& path, const SoftBodyModel& model) {
  return parseVertices(readTextFile(path), path, model);
}

std::vector<DeadLoad> parseVertexForces(std::string_view text, const std::string& name, const SoftBodyModel& model,
                                        const DeadLoad& whole) {
  std::vector<DeadLoad> loads;
  std::vector<bool> loaded(model.nodeOfInputVertex.size());
  forEachVertex(text, name, model, kForceColumns, [&](const CsvRows& row, int vertex, int node) {
    if (loaded[vertex]) row.fail(fmt::format("vertex {} stands twice", vertex));
    loaded[vertex] = true;
    DeadLoad& load = loads.emplace_back(whole);
    load.node = node;
    for (int k = 0; k < 3; ++k) load.force[k] = row.number(k + 1, kForceColumns[k + 1]);
    if (load.force.cwiseAbs().maxCoeff() > kAnyForce.most)
      row.fail(fmt::format("a force beyond {:g} N", kAnyForce.most));
  });
  return loads;
}

std::vector<DeadLoad> readVertexForces(const std::string& path, const SoftBodyModel& model, const DeadLoad& whole) {
  return parseVertexForces(readTextFile(path), path, model, whole);
}

}  // namespace medulla
