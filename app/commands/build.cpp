#include <fmt/format.h>

#include <Eigen/Geometry>
#include <filesystem>

#include "app/commands/commands.h"
#include "app/files/mesh_file.h"
#include "app/files/model_file.h"
#include "app/files/output_file.h"
#include "app/files/report_file.h"
#include "app/interrupt.h"
#include "app/progress.h"

namespace medulla {

// The command that repeats the build, file names without folders: the model is the same wherever it is built.
static std::string repeatingCommand(const BuildOptions& options) {
  namespace fs = std::filesystem;
  std::string command = fmt::format("medulla build {} {}", fs::path(options.mesh).filename().string(),
                                    describeSettings(options.settings));
  if (options.unit != "m") command += " --unit " + options.unit;
  if (!options.fine.empty()) command += " --fine " + fs::path(options.fine).filename().string();
  return command;
}

static RepairedMesh repaired(const std::string& path, const TriangleMesh& mesh) {
  try {
    return repairMesh(mesh);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", path, error.what()));
  }
}

// An organ of 60 m is a mesh in millimetres read as metres.
static void warnOfSize(const std::string& path, const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  const double size = box.diagonal().norm();
  if (size > 5 || size < 0.005)
    fmt::print(stderr, "{}: note: the mesh is {:.3g} m across; is --unit right?\n", path, size);
}

int runBuild(const BuildOptions& options) {
  requireDistinctFiles({options.output, options.reportPath}, {options.mesh, options.fine});
  { const OutputFile writableAtAll(options.output); }
  if (!options.reportPath.empty()) const OutputFile writableAtAll(options.reportPath);
  const double scale = metresPerUnit(options.unit);
  const TriangleMesh input = readMesh(options.mesh, scale);
  warnOfSize(options.mesh, input);
  const RepairedMesh mesh = repaired(options.mesh, input);
  for (const std::string& note : mesh.notes) fmt::print(stderr, "{}: {}\n", options.mesh, note);
  TriangleMesh fine;
  if (!options.fine.empty()) fine = readMesh(options.fine, scale);

  BuildReport report;
  Progress progress("build", 100, "%");
  SoftBodyModel model;
  try {
    model = buildModel(mesh, options.fine.empty() ? nullptr : &fine, options.settings, report, [&](double share) {
      checkInterrupt();
      progress.update(100 * share);
    });
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", options.mesh, error.what()));
  }
  model.name = std::filesystem::path(options.mesh).stem().string();
  model.meshHash = hashMesh(input);
  model.settings = repeatingCommand(options);
  const std::vector<Result> results = buildResults(report);
  writeModel(options.output, model);
  if (!options.reportPath.empty()) writeReport(options.reportPath, results);
  printResults(results);
  return 0;
}

}  // namespace medulla
