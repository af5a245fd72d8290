#include "tests/accuracy_reference.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <numbers>
#include <set>
#include <string>

#include "app/files/mesh_file.h"

// The references themselves: whole, in balance, and right where theory has an answer. What the program makes of the
// same cases is tested elsewhere.
namespace medulla {
namespace {

using namespace reference;

// clang-format off
const char* const kStatic[] = {
    "cylinder_tip", "cylinder_tip_large", "cylinder_mid", "cylinder_axial", "cylinder_torsion", "cylinder_poke_small",
    "cylinder_poke_large", "gallbladder_tip", "gallbladder_tip_large", "gallbladder_mid", "gallbladder_axial",
    "gallbladder_torsion", "gallbladder_twist", "gallbladder_poke_small", "gallbladder_poke_large", "liver_tip", "liver_tip_in_plane", "liver_mid",
    "liver_axial", "liver_stretched_tip", "liver_stretched_axial", "gallbladder_halved_tip_large", "gallbladder_halved_pull",
    "gallbladder_doubled_tip_large", "gallbladder_doubled_pull", "liver_torsion", "liver_poke_small", "liver_poke_large",
    "stomach_press", "kidney_tip", "stomach_pull", "cube_pull", "cube_pull_far", "cube_shear"};
// clang-format on
const char* const kBodies[] = {"cylinder", "gallbladder", "liver"};
const char* const kStepped[] = {"cylinder", "gallbladder"};

TriangleMesh meshOf(const Result& result) {
  return readMesh(std::string(MEDULLA_SOURCE_DIR "/") + result.text("mesh"));
}

std::vector<Vector3d> displacements(const Result& result) {
  return result.vectors(result.number("unit"));
}

double volume(const TriangleMesh& mesh, const std::vector<Vector3d>& displacement) {
  const auto at = [&](int v) -> Vector3d { return mesh.vertices[v] + displacement[v]; };
  double sum = 0;
  for (const auto& t : mesh.triangles) sum += at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6;
  return sum;
}

double largest(const std::vector<Vector3d>& vectors) {
  double most = 0;
  for (const Vector3d& v : vectors) most = std::max(most, v.norm());
  return most;
}

class StaticReference : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, StaticReference, testing::ValuesIn(kStatic),
                         [](const auto& tested) { return tested.param; });

TEST_P(StaticReference, IsWhole) {
  const Result result = readResult(GetParam());
  const TriangleMesh mesh = meshOf(result);
  EXPECT_EQ(result.text("case"), GetParam());
  EXPECT_EQ(result.number("vertices"), mesh.vertices.size());
  ASSERT_EQ(result.rows.size(), mesh.vertices.size());
  for (const auto& row : result.rows) ASSERT_EQ(row.size(), 3u);
  for (const char* key : {"young", "poisson", "density", "material", "columns"}) EXPECT_FALSE(result.text(key).empty());
  const std::vector<Vector3d> u = displacements(result);
  EXPECT_NEAR(largest(u), result.number("displacement_max"), 2 * result.number("unit"));
  const std::vector<Vector3d> still(u.size(), Vector3d::Zero());
  EXPECT_NEAR(volume(mesh, still), result.number("volume"), 1e-6 * volume(mesh, still));
  EXPECT_NEAR(volume(mesh, u) / volume(mesh, still), result.number("volume_ratio"), 1e-4);
  // Nearly incompressible; only a stretch changes the volume by more than half a percent.
  // Triangles span the hollow rim of what a strong pull draws out of a flat side.
  const bool drawnOut = std::string(GetParam()) == "cube_pull_far";
  EXPECT_NEAR(result.number("volume_ratio"), result.number("volume_ratio_fine"), drawnOut ? 0.006 : 0.004);
}

TEST_P(StaticReference, IsHeldWhereItSaysAndLoadedElsewhere) {
  const Result result = readResult(GetParam());
  const std::vector<Vector3d> u = displacements(result);
  const std::vector<int> fix = readFix(result);
  EXPECT_GE(fix.size(), 3u);
  const std::set<int> held(fix.begin(), fix.end());
  EXPECT_EQ(held.size(), fix.size());
  for (int v : fix) EXPECT_EQ(u.at(v), Vector3d(0, 0, 0)) << v;
  for (const auto& [v, force] : readLoad(result)) {
    EXPECT_FALSE(held.contains(v)) << v;
    EXPECT_GT(u.at(v).norm(), 0) << v;
  }
}

TEST_P(StaticReference, ForcesAndMomentsBalance) {
  const Result result = readResult(GetParam());
  const TriangleMesh mesh = meshOf(result);
  const std::vector<Vector3d> u = displacements(result);
  Vector3d force = Vector3d::Zero(), rest = force, deformed = force;
  double scale = 0, lever = 0;
  for (const auto& [v, f] : readLoad(result)) {
    force += f;
    rest += mesh.vertices[v].cross(f);
    deformed += (mesh.vertices[v] + u[v]).cross(f);
    scale += f.norm();
    lever = std::max(lever, (mesh.vertices[v] + u[v]).norm());
  }
  EXPECT_LT((force - result.vector("force")).norm(), 1e-7 * scale);
  EXPECT_LT((rest - result.vector("moment")).norm(), 1e-6 * scale * lever);
  EXPECT_LT((result.vector("reaction_force") + force).norm(), 1e-3 * scale);
  // The load follows the vertices' linear interpolation here, the elements' quadratic one there.
  EXPECT_LT((result.vector("reaction_moment") + deformed).norm(), 0.01 * scale * lever);
}

TEST_P(StaticReference, EnergyIsTheWorkOfTheLoad) {
  const Result result = readResult(GetParam());
  const std::vector<Vector3d> u = displacements(result);
  const double energy = result.number("strain_energy");
  // CalculiX sums its energy over the load increments by the trapezium rule: a percent where a body stretches by 25 %.
  EXPECT_NEAR(result.number("work"), energy, 0.02 * energy);
  double full = 0;
  for (const auto& [v, f] : readLoad(result)) full += f.dot(u[v]);
  // Half of force times way where the body is linear; bending stiffens it, stretch softens it. The middle of a dent,
  // deepest of all, lies between the vertices of a small patch.
  EXPECT_GT(energy, 0.4 * full);
  EXPECT_LT(energy, 0.8 * full);
}

TEST_P(StaticReference, SaysHowFarItsMeshIsOff) {
  const Result result = readResult(GetParam());
  const bool poke = std::string(GetParam()).find("poke") != std::string::npos;
  EXPECT_GT(result.number("mesh_error_max"), 0);
  EXPECT_LE(result.number("mesh_error_rms"), result.number("mesh_error_max"));
  // Where a patch of a flat side is loaded by half of Young's modulus, the patch's rim is as a poke's.
  const bool cube = std::string(GetParam()).find("cube_pull") != std::string::npos;
  EXPECT_LT(result.number("mesh_error_max"), poke ? 5 : cube ? 3.5 : 2.5);
  EXPECT_NEAR(result.number("displacement_max_extrapolated"), result.number("displacement_max"),
              0.03 * result.number("displacement_max"));
}

// The cylinder is a prism of 18 sides.
struct Prism {
  double length = 0.1, radius = 0.01, young = 1e4, poisson = 0.45, density = 1000;
  double turn = 2 * std::numbers::pi / 18;
  double area = 9 * radius * radius * std::sin(turn);
  double second =
      area * radius * radius * (2 + std::cos(turn)) / 12;  // of the section, about any axis through its middle
  double shear = young / (2 * (1 + poisson)), bulk = young / (3 * (1 - 2 * poisson));
};

TEST(CylinderReference, IsThePrismThatTheoryIsAskedAbout) {
  const Result result = readResult("cylinder_tip");
  const Prism prism;
  EXPECT_EQ(result.number("young"), prism.young);
  EXPECT_EQ(result.number("poisson"), prism.poisson);
  EXPECT_EQ(result.number("density"), prism.density);
  EXPECT_NEAR(result.number("volume"), prism.area * prism.length, 1e-5 * prism.area * prism.length);
}

TEST(CylinderReference, BendsLikeTimoshenkosBeam) {
  const Result result = readResult("cylinder_tip");
  const Prism p;
  const double force = result.vector("force").norm();
  const double beam =
      force * std::pow(p.length, 3) / (3 * p.young * p.second) + force * p.length / (0.9 * p.shear * p.area);
  // The root's section cannot grow or shrink, which stiffens half a diameter of the beam.
  EXPECT_LT(result.number("displacement_load"), beam);
  EXPECT_GT(result.number("displacement_load"), 0.95 * beam);
}

TEST(CylinderReference, BendsAlikeOnBothSidesOfItsPlane) {
  const Result result = readResult("cylinder_tip_large");
  const TriangleMesh mesh = meshOf(result);
  const std::vector<Vector3d> u = displacements(result);
  int pairs = 0;
  for (std::size_t a = 0; a < u.size(); ++a) {
    const Vector3d mirrored = mesh.vertices[a].cwiseProduct(Vector3d(1, -1, 1));
    for (std::size_t b = 0; b < u.size(); ++b) {
      if ((mesh.vertices[b] - mirrored).norm() > 1e-6) continue;
      ++pairs;
      EXPECT_LT((u[b] - u[a].cwiseProduct(Vector3d(1, -1, 1))).norm(), 0.003 * result.number("displacement_max"));
    }
  }
  EXPECT_EQ(pairs, 380);  // all but the nine inner vertices of either end
}

// Lateral stretch of a neo-Hookean bar that is stretched by `stretch`, and the force per area at rest that it takes.
std::pair<double, double> uniaxial(const Prism& p, double stretch) {
  const auto lateralStress = [&](double a) {
    const double j = stretch * a * a, i1 = stretch * stretch + 2 * a * a;
    return p.shear / 2 * (4 * a * std::pow(j, -2. / 3) - 4. / 3 * i1 * std::pow(j, -5. / 3) * stretch * a) +
           p.bulk * (j - 1) * 2 * stretch * a;
  };
  double low = 0.5, high = 1.2;
  for (int i = 0; i < 60; ++i) {
    const double a = (low + high) / 2;
    (lateralStress(a) < 0 ? low : high) = a;
  }
  const double a = low, j = stretch * a * a, i1 = stretch * stretch + 2 * a * a;
  const double stress =
      p.shear / 2 * (2 * stretch * std::pow(j, -2. / 3) - 2. / 3 * i1 * std::pow(j, -5. / 3) * a * a) +
      p.bulk * (j - 1) * a * a;
  return {a, stress};
}

TEST(CylinderReference, StretchesLikeANeoHookeanBar) {
  const Result result = readResult("cylinder_axial");
  const TriangleMesh mesh = meshOf(result);
  const std::vector<Vector3d> u = displacements(result);
  const Prism p;
  // Far from the ends: the rings at 30 and 70 mm.
  double near = 0, far = 0, width = 0;
  int rings = 0;
  for (std::size_t v = 0; v < u.size(); ++v) {
    const Vector3d& x = mesh.vertices[v];
    if (std::abs(x.x() - 0.03) < 1e-6) near += u[v].x() / 18;
    if (std::abs(x.x() - 0.07) < 1e-6) far += u[v].x() / 18;
    if (std::abs(x.x() - 0.05) < 1e-6) {
      width += std::hypot(x.y() + u[v].y(), x.z() + u[v].z()) / p.radius / 18;
      ++rings;
    }
  }
  ASSERT_EQ(rings, 18);
  const double stretch = 1 + (far - near) / 0.04;
  EXPECT_NEAR(stretch, 1.25, 0.02);
  const auto [lateral, stress] = uniaxial(p, stretch);
  EXPECT_NEAR(stress * p.area, result.vector("force").x(), 0.001 * result.vector("force").x());
  EXPECT_NEAR(width, lateral, 0.001);
}

TEST(CylinderReference, TwistsLikeABar) {
  const Result result = readResult("cylinder_torsion");
  const TriangleMesh mesh = meshOf(result);
  const std::vector<Vector3d> u = displacements(result);
  const Prism p;
  double near = 0, far = 0;
  for (std::size_t v = 0; v < u.size(); ++v) {
    const Vector3d x = mesh.vertices[v], y = x + u[v];
    const double angle = std::atan2(x.y() * y.z() - x.z() * y.y(), x.y() * y.y() + x.z() * y.z());
    if (std::abs(x.x() - 0.03) < 1e-6) near += angle / 18;
    if (std::abs(x.x() - 0.07) < 1e-6) far += angle / 18;
  }
  // Dead forces on a turned section have a smaller moment: that of the reaction counts. The torsion
  // constant of 18 sides is the polar moment within a percent.
  const double twist = std::abs(result.vector("reaction_moment").x()) * 0.04 / (p.shear * 2 * p.second);
  EXPECT_GT(far - near, 0.1);
  EXPECT_NEAR(far - near, twist, 0.01 * twist);
}

TEST(CylinderReference, SwingsLikeABar) {
  const Result result = readResult("cylinder_modes");
  const std::vector<double> f = result.numbers("frequencies");
  ASSERT_GE(f.size(), 8u);
  const Prism p;
  const double bending =
      std::sqrt(p.young * p.second / (p.density * p.area)) / (2 * std::numbers::pi * p.length * p.length);
  EXPECT_NEAR(f[0], 1.8751 * 1.8751 * bending, 0.01 * f[0]);
  EXPECT_NEAR(f[1], f[0], 0.001 * f[0]);  // a pair, in two planes
  EXPECT_NEAR(f[2], std::sqrt(p.shear / p.density) / (4 * p.length), 0.01 * f[2]);
  EXPECT_NEAR(f[4], f[3], 0.001 * f[3]);
  EXPECT_NEAR(f[5], std::sqrt(p.young / p.density) / (4 * p.length), 0.02 * f[5]);
  EXPECT_NEAR(f[7], f[6], 0.001 * f[6]);
}

class BodyReference : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, BodyReference, testing::ValuesIn(kBodies),
                         [](const auto& tested) { return tested.param; });

TEST_P(BodyReference, ModesAreOrderedNormalisedAndHeld) {
  const Result result = readResult(std::string(GetParam()) + "_modes");
  const int count = static_cast<int>(result.number("modes"));
  const std::vector<double> f = result.numbers("frequencies"), limit = result.numbers("frequencies_extrapolated");
  const std::vector<double> error = result.numbers("mesh_error");
  ASSERT_EQ(f.size(), static_cast<std::size_t>(count));
  ASSERT_EQ(limit.size(), f.size());
  ASSERT_EQ(result.numbers("modal_masses").size(), f.size());
  EXPECT_TRUE(std::is_sorted(f.begin(), f.end()));
  const TriangleMesh mesh = meshOf(result);
  ASSERT_EQ(result.rows.size(), mesh.vertices.size());
  const double mass =
      result.number("density") * volume(mesh, std::vector<Vector3d>(result.rows.size(), Vector3d::Zero()));
  for (int k = 0; k < count; ++k) {
    const std::vector<Vector3d> shape = result.vectors(result.number("unit"), 3 * k);
    EXPECT_NEAR(largest(shape), 1, 2e-4);
    for (int v : readFix(result)) EXPECT_EQ(shape.at(v), Vector3d(0, 0, 0));
    EXPECT_GT(result.numbers("modal_masses")[k], 0);
    EXPECT_LT(result.numbers("modal_masses")[k], mass);
    EXPECT_LT(error.at(k), 1.5);
    EXPECT_LE(limit[k], f[k]);  // refinement makes a body softer
  }
}

class StepReference : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, StepReference, testing::ValuesIn(kStepped),
                         [](const auto& tested) { return tested.param; });

TEST_P(StepReference, ResponseStartsAtRestAndDecaysAsDamped) {
  const Result result = readResult(std::string(GetParam()) + "_step");
  const double period = 1 / result.number("frequencies"), beta = result.number("rayleigh_beta");
  const double zeta = std::numbers::pi * beta / period;
  EXPECT_NEAR(zeta, 0.05, 1e-5);
  const Vector3d final = result.vector("static");
  ASSERT_GT(result.rows.size(), 100u);
  ASSERT_EQ(result.rows[0], std::vector<double>(4, 0));
  // At whole and half periods of the damped first mode it swings about its static value, less each time.
  const double damped = period / std::sqrt(1 - zeta * zeta);
  const auto at = [&](double t) {
    std::size_t i = 1;
    while (i + 1 < result.rows.size() && result.rows[i][0] * 1e-5 < t) ++i;
    const auto &a = result.rows[i - 1], &b = result.rows[i];
    const double w = (t / 1e-5 - a[0]) / (b[0] - a[0]);
    const Vector3d u = 1e-7 * ((1 - w) * Vector3d(a[1], a[2], a[3]) + w * Vector3d(b[1], b[2], b[3]));
    return u.dot(final) / final.squaredNorm() - 1;
  };
  for (int half = 2; half <= 6; ++half) {
    const double ratio = -at((half + 1) * damped / 2) / at(half * damped / 2);
    EXPECT_NEAR(std::log(1 / ratio), std::numbers::pi * zeta / std::sqrt(1 - zeta * zeta), 0.04) << half;
  }
  EXPECT_NEAR(result.number("static_share_of_modes"), 1, 0.05);
}

// The step's load is a share of the case "tip", which is nearly linear, but kept on a coarser grid.
TEST_P(StepReference, EndsWhereTheStaticCaseDoes) {
  const Result step = readResult(std::string(GetParam()) + "_step"), tip = readResult(std::string(GetParam()) + "_tip");
  const double share = step.vector("force").norm() / tip.vector("force").norm();
  const Vector3d direction = tip.vector("force").normalized();
  const double expected = share * tip.number("displacement_load");
  EXPECT_NEAR(step.vector("static").dot(direction), expected, 0.06 * expected);
}

// A reference that stands in no list is one that nothing keeps whole.
TEST(AccuracyReferences, EachIsInOneOfTheLists) {
  std::multiset<std::string> listed(std::begin(kStatic), std::end(kStatic)), found;
  for (const std::string body : kBodies) listed.insert(body + "_modes");
  for (const std::string body : kStepped) listed.insert(body + "_step");
  for (const auto& entry : std::filesystem::directory_iterator(folder()))
    if (entry.path().extension() == ".txt") found.insert(entry.path().stem().string());
  EXPECT_EQ(found, listed);
}

TEST(AccuracyReferences, AreSmall) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder())) bytes += entry.file_size();
  EXPECT_LT(bytes, 600'000u);
}

}  // namespace
}  // namespace medulla
