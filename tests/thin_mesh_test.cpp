#include <fmt/core.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "physics/model/build.h"
#include "physics/model/identify/slits.h"
#include "physics/model/identify/thin_parts.h"
#include "physics/model/identify/voxel_solid.h"
#include "physics/model/mesh_repair.h"
#include "tests/complaint.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"
#include "tests/test_shapes.h"

// Bodies too thin for the finite elements that they may have: refused with the part of them that is. Others that links
// do not follow: told.
namespace medulla {
namespace {

using Eigen::Vector3d;

// A body of revolution along x, 120 mm long. `radius` (mm) of x (mm).
std::string turnedObj(const std::function<double(double)>& radius) {
  std::string text;
  const TriangleMesh mesh = cylinderMesh(120, 1, 18, 48);
  for (const Vector3d& x : mesh.vertices)
    text += fmt::format("v {} {} {}\n", x.x(), x.y() * radius(x.x()), x.z() * radius(x.x()));
  for (const auto& [a, b, c] : mesh.triangles) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

// Its ends are blunt, so that there are balls for them.
double lobes(double x, double neck, double width) {
  const double end = std::max(0., std::abs(x - 60) - 50) / 11;
  return (neck + (20 - neck) * (1 - std::exp(-std::pow((x - 60) / width, 2)))) *
         std::sqrt(std::max(0.05, 1 - end * end));
}

void expectRefused(const std::function<double(double)>& radius, const std::vector<std::string>& says,
                   double place) {  // m along x
  const TemporaryFolder folder;
  folder.write("body.obj", turnedObj(radius));
  const ProgramResult r =
      runProgram({"build", folder / "body.obj", "--unit", "mm", "--overshoot", "0", "--render-levels", "0",
                  "--identify", "--fix", "plane=1,0,0,0.001", "-o", folder / "body.xml"});
  EXPECT_EQ(r.exitCode, 1);
  EXPECT_EQ(r.out, "");
  const std::size_t line = r.err.find("medulla: " + (folder / "body.obj"));  // after what was repaired
  ASSERT_NE(line, std::string::npos) << r.err;
  EXPECT_EQ(r.err.find('\n', line), r.err.size() - 1) << r.err;
  for (const std::string& words : says) EXPECT_NE(r.err.find(words, line), std::string::npos) << r.err;
  const std::size_t near = r.err.find("near (", line);
  ASSERT_NE(near, std::string::npos) << r.err;
  EXPECT_NEAR(std::stod(r.err.substr(near + 6)), place, 0.002) << r.err;
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"body.obj"});
}

TEST(ThinMesh, ANeckThatAsksForMoreFiniteElementsThanMemoryHoldsIsRefusedWithItsPlace) {
  expectRefused(
      [](double x) { return lobes(x, 1.5, 20); },
      {"finite elements of 1.", ", expected at most ", "too thin for its size: the neck of 3", "between spheres"},
      0.06);
}

// Of less than a hundredth of the section beside it: no gap that its neighbours' sections fill.
TEST(ThinMesh, AWaistIsRefusedWithItsPlace) {
  expectRefused([](double x) { return std::abs(x - 60) < 4 ? 1 : 20; },
                {"expected at most ", "too thin for its size: the neck of "}, 0.06);
}

// So short that no station of a link lies in it.
TEST(ThinMesh, AHairThinNeckIsRefusedWithItsPlace) {
  for (const double neck : {0.3, 0.1})
    expectRefused([&](double x) { return lobes(x, neck, 8); },
                  {"finite elements of 0.", "too thin for its size: the neck of 0."}, 0.06);
}

// What hangs on a neck and is less than a fiftieth of the body asks for no smaller elements: it moves with the neck,
// if there are any there.
TEST(ThinMesh, ASpikeThatReachesBeyondAllFiniteElementsIsRefusedWithItsEnd) {
  expectRefused([](double x) { return x < 70 ? 20 : std::max(0.3, 20 * std::exp((70 - x) / 6)); },
                {"too thin near (", "finite elements of 3.9", "before it"}, 0.12);
}

TEST(ThinMesh, AKnobOnAHairIsRefusedWithThePlaceBeforeIt) {
  const auto radius = [](double x) {
    if (x > 106) return 5.;
    return x < 70 ? 20 : std::max(0.2, 20 * std::exp((70 - x) / 3));
  };
  expectRefused(radius, {"too thin near (", "finite elements of", "fall apart there"}, 0.093);
}

// Few spheres for a block that is no bar: what a scene of it would be off by is said.
TEST(IdentifiedBuild, SaysWhereItIsFarOff) {
  const TemporaryFolder folder;
  folder.write("block.obj",
               "v 0 0 0\nv 0.05 0 0\nv 0.05 0.05 0\nv 0 0.05 0\nv 0 0 0.05\nv 0.05 0 0.05\nv 0.05 0.05 0.05\n"
               "v 0 0.05 0.05\nf 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\n"
               "f 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n");
  const ProgramResult far = runProgram({"build", folder / "block.obj", "-o", folder / "a.xml", "--spheres", "4",
                                        "--render-levels", "0", "--identify", "--fix", "plane=1,0,0,0.01"});
  EXPECT_EQ(far.exitCode, 0) << far.err;
  EXPECT_NE(far.err.find("the links are off by "), std::string::npos) << far.err;
  const std::string cylinder = MEDULLA_SOURCE_DIR "/tests/accuracy/cylinder.obj";
  const ProgramResult near = runProgram({"build", cylinder, "-o", folder / "b.xml", "--spheres", "5", "--render-levels",
                                         "0", "--identify", "--fix", "plane=1,0,0,0.001"});
  EXPECT_EQ(near.exitCode, 0) << near.err;
  EXPECT_EQ(near.err.find("the links are off by "), std::string::npos) << near.err;
}

TEST(ThinMesh, PlacesAreSaidWithoutNegativeZeros) {
  EXPECT_EQ(placeText({-1e-7, 0.05994, -0.12}), "(0.0000, 0.0599, -0.1200)");
}

std::vector<double> evenly(double from, double to, int parts) {
  std::vector<double> out;
  for (int k = 0; k <= parts; ++k) out.push_back(std::lerp(from, to, double(k) / parts));
  return out;
}

// The surface of those cells of a grid that are solid.
template <class Solid>
TriangleMesh gridMesh(const std::array<std::vector<double>, 3>& cuts, const Solid& isSolid) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, int> numbers;
  const auto solid = [&](const std::array<int, 3>& c) {
    for (int a = 0; a < 3; ++a)
      if (c[a] < 0 || c[a] + 1 >= int(cuts[a].size())) return false;
    return isSolid(c);
  };
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [entry, fresh] = numbers.try_emplace(at, int(mesh.vertices.size()));
    if (fresh) mesh.vertices.emplace_back(cuts[0][at[0]], cuts[1][at[1]], cuts[2][at[2]]);
    return entry->second;
  };
  const auto addFace = [&](std::array<int, 3> corner, int axis, bool isHigh) {
    corner[axis] += isHigh ? 1 : 0;
    std::array<int, 4> face{};
    for (int k = 0; k < 4; ++k) {
      std::array<int, 3> at = corner;
      at[(axis + 1) % 3] += k == 1 || k == 2 ? 1 : 0;
      at[(axis + 2) % 3] += k >= 2 ? 1 : 0;
      face[isHigh ? k : 3 - k] = vertex(at);
    }
    mesh.triangles.push_back({face[0], face[1], face[2]});
    mesh.triangles.push_back({face[0], face[2], face[3]});
  };
  std::array<int, 3> c{};
  for (c[0] = 0; c[0] + 1 < int(cuts[0].size()); ++c[0])
    for (c[1] = 0; c[1] + 1 < int(cuts[1].size()); ++c[1])
      for (c[2] = 0; c[2] + 1 < int(cuts[2].size()); ++c[2])
        for (int axis = 0; axis < 3 && solid(c); ++axis)
          for (const int way : {-1, 1}) {
            std::array<int, 3> next = c;
            next[axis] += way;
            if (!solid(next)) addFace(c, axis, way > 0);
          }
  return mesh;
}

// A fin of 2.4 mm on a cube of 120 mm, two per cent of the whole, is thinner than voxels are, and stands on a column of
// them or between two.
TEST(ThinMesh, AFinKeepsItsSpheresWhereverItStands) {
  for (const double x : {0.055, 0.058}) {
    SCOPED_TRACE(x);
    std::vector<double> across = evenly(0, x, 6);
    for (const double cut : evenly(x + 0.0024, 0.12, 6)) across.push_back(cut);
    const TriangleMesh mesh = gridMesh({across, evenly(0, 0.24, 24), evenly(0, 0.12, 12)},
                                       [](const std::array<int, 3>& c) { return c[1] < 12 || c[0] == 6; });
    BuildSettings settings;
    settings.spheres = 20;
    BuildReport report;
    const SoftBodyModel model = buildModel(repairMesh(mesh), nullptr, settings, report);
    EXPECT_EQ(model.spheres.size(), 20u);
    EXPECT_LT(report.gapMax, 10);
  }
}

TEST(ThinMesh, ARodThatLiesAslantIsRefusedBeforeItsBoxFillsTheMemory) {
  TriangleMesh rod = cylinderMesh(0.4, 0.01, 16, 40);
  SolidSettings settings;
  settings.memoryMax = 3e7;
  EXPECT_EQ(complaintOf([&] { makeVoxelSolid(rod, 0.01, settings); }), "");
  const Eigen::Matrix3d aslant =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), Vector3d(1, 1, 1)).toRotationMatrix();
  for (Vector3d& x : rod.vertices) x = aslant * x;
  const std::string complaint = complaintOf([&] { makeVoxelSolid(rod, 0.01, settings); });
  EXPECT_NE(complaint.find("lies aslant"), std::string::npos) << complaint;
}

TEST(ThinMesh, SlitsThinnerThanACellAreFoundAndCreasesAreNone) {
  const std::optional<Slit> slit = narrowestSlit(blocksMesh(0.001), 0.004);
  ASSERT_TRUE(slit);
  EXPECT_NEAR(slit->width, 0.001, 1e-6);
  EXPECT_FALSE(narrowestSlit(blocksMesh(0.005), 0.004));
  for (const char* organ : {"liver/liver.obj", "stomach/stomach.obj"})
    EXPECT_FALSE(narrowestSlit(assetMesh(organ), 0.008)) << organ;
}

}  // namespace
}  // namespace medulla
