#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "app/files/fix_text.h"
#include "app/files/mesh_file.h"
#include "physics/dynamics/fixation.h"
#include "physics/dynamics/rest_modes.h"
#include "physics/dynamics/world.h"
#include "physics/model/build.h"
#include "physics/model/identify/identify.h"
#include "physics/model/node_volumes.h"
#include "tests/accuracy_reference.h"
#include "tests/test_shapes.h"

// What the program makes of the load cases that finite elements solved (tests/accuracy). Limits are the errors reached,
// a little above; tests/accuracy/README.md lists them, and says which cases set a constant and so prove nothing.
namespace medulla {
namespace {

using namespace reference;

// Made once per body and number of spheres.
std::shared_ptr<const SoftBodyModel> modelOf(const Result& result, int spheres) {
  static std::map<std::pair<std::string, int>, std::shared_ptr<const SoftBodyModel>> made;
  std::shared_ptr<const SoftBodyModel>& model = made[{result.text("mesh"), spheres}];
  if (model) return model;
  BuildSettings settings;
  settings.spheres = spheres;
  settings.overshoot = 0;  // as the scenes' models are
  settings.renderLevels = 0;
  BuildReport report;
  const TriangleMesh mesh = readMesh(std::string(MEDULLA_SOURCE_DIR "/") + result.text("mesh"));
  model = std::make_shared<SoftBodyModel>(buildModel(asRepaired(mesh), nullptr, settings, report));
  return model;
}

// The same with what finite elements find, held in `region`.
std::shared_ptr<const SoftBodyModel> identifiedModelOf(const Result& result, int spheres, const std::string& region) {
  static std::map<std::pair<std::string, int>, std::shared_ptr<const SoftBodyModel>> made;
  std::shared_ptr<const SoftBodyModel>& model = made[{result.text("mesh") + region, spheres}];
  if (model) return model;
  const auto own = std::make_shared<SoftBodyModel>(*modelOf(result, spheres));
  IdentifySettings settings;
  settings.poisson = result.number("poisson");
  const HeldRegion held = parseHeldRegion(region, *own);
  own->identified = std::make_shared<IdentifiedNetwork>(identifyNetwork(*own, {held}, settings).network);
  shareOutMassByLayer(own->identified->layer, BuildSettings().surfaceMassFraction, *own);
  return model = own;
}

// The reference's body under `share` of its load from `from` to `to` (s) and for good, held as it says.
BodyDescription bodyOf(const Result& result, std::shared_ptr<const SoftBodyModel> model, double from, double to) {
  BodyDescription body;
  body.name = result.text("case");
  body.model = std::move(model);
  body.tissue.young = result.number("young");
  body.tissue.poisson = result.number("poisson");
  body.tissue.density = result.number("density");
  for (const int vertex : readFix(result)) body.fixedNodes.push_back(body.model->nodeOfInputVertex[vertex]);
  for (const int sphere : spheresHeldBy(*body.model, body.fixedNodes)) body.fixed.push_back({sphere});
  for (const auto& [vertex, force] : readLoad(result)) {
    body.deadLoads.push_back({body.model->nodeOfInputVertex[vertex], force, from, to});
  }
  return body;
}

World worldOf(const BodyDescription& body) {
  WorldSettings settings;
  settings.gravity.setZero();
  return World(settings, {body});
}

struct Error {
  double max = 0, rms = 0;  // % of the largest displacement
  double volume = 0;        // %, of the volume ratios
};

Error errorAtRest(const Result& result, const BodyDescription& loaded, double seconds) {
  BodyDescription body = loaded;
  body.tissue.damping = 1;
  World world = worldOf(body);
  // A body that begins to give way swings more slowly than at rest: on to where the last half moved nothing by three
  // ten-thousandths of the way.
  DynamicsFrame frame, before;
  const auto moves = [&] {
    double way = 0, size = 0;
    for (std::size_t n = 0; n < body.model->restNodes.size(); ++n) {
      way = std::max(way, (frame.bodies[0].nodes[n] - before.bodies[0].nodes[n]).norm());
      size = std::max(size, (frame.bodies[0].nodes[n] - body.model->restNodes[n]).norm());
    }
    return way > 3e-4 * size;
  };
  const double half = 0.5 * seconds;
  for (double until = half; until < 1.1 * seconds || (moves() && until < 10 * seconds); until += half) {
    while (world.time() < until) world.advance({});
    before = frame;
    world.readFrame(frame);
  }
  const std::vector<Vector3d> expected = result.vectors(result.number("unit"));
  double largest = 0, worst = 0, sum = 0;
  for (std::size_t v = 0; v < expected.size(); ++v) {
    const int node = body.model->nodeOfInputVertex[v];
    const Vector3d moved = frame.bodies[0].nodes[node] - body.model->restNodes[node];
    largest = std::max(largest, expected[v].norm());
    worst = std::max(worst, (moved - expected[v]).norm());
    sum += (moved - expected[v]).squaredNorm();
  }
  return {100 * worst / largest, 100 * std::sqrt(sum / static_cast<double>(expected.size())) / largest,
          100 * (world.volumeRatio(0) - result.number("volume_ratio"))};
}

struct StaticCase {
  const char* name;
  int spheres;
  double max, rms, volume;           // %
  const char* identified = nullptr;  // what is held, for links that finite elements identify
};

constexpr double kSeconds = 6;  // the load grows for the first three tenths

BodyDescription bodyOf(const StaticCase& c, const Result& result) {
  if (c.identified == nullptr) return bodyOf(result, modelOf(result, c.spheres), 0, 0.3 * kSeconds);
  BodyDescription body = bodyOf(result, identifiedModelOf(result, c.spheres, c.identified), 0, 0.3 * kSeconds);
  body.links = LinkModel::identified;
  body.fixedNodes = body.model->identified->patches[0].nodes;
  body.fixed.clear();  // what is held is a frame of its own
  for (const int sphere : body.model->identified->heldFrames) body.fixed.push_back({sphere});
  return body;
}

void PrintTo(const StaticCase& c, std::ostream* out) {
  *out << c.name;
}

class StaticAccuracy : public testing::TestWithParam<StaticCase> {};

TEST_P(StaticAccuracy, SurfaceLiesWhereFiniteElementsPutIt) {
  const StaticCase& limit = GetParam();
  const Result result = readResult(limit.name);
  const Error error = errorAtRest(result, bodyOf(limit, result), kSeconds);
  EXPECT_LE(error.max, limit.max);
  EXPECT_LE(error.rms, limit.rms);
  EXPECT_LE(std::abs(error.volume), limit.volume);
  RecordProperty("max", std::to_string(error.max));
  RecordProperty("rms", std::to_string(error.rms));
  RecordProperty("volume", std::to_string(error.volume));
}

std::string nameOf(const testing::TestParamInfo<StaticCase>& tested) {
  const StaticCase& c = tested.param;
  return c.spheres == 25 ? c.name + std::string("_of_25") : std::string(c.name);
}

INSTANTIATE_TEST_SUITE_P(
    All, StaticAccuracy,
    testing::Values(
        StaticCase{"cylinder_tip", 7, 0.35, 0.18, 0.1}, StaticCase{"cylinder_tip_large", 7, 0.9, 0.46, 0.1},
        StaticCase{"cylinder_mid", 7, 0.95, 0.6, 0.1}, StaticCase{"cylinder_axial", 7, 2.5, 0.8, 0.55},
        StaticCase{"cylinder_torsion", 7, 1.45, 0.52, 0.1}, StaticCase{"cylinder_poke_small", 7, 25.6, 4.1, 0.18},
        StaticCase{"cylinder_poke_large", 7, 28.1, 7.2, 0.49}, StaticCase{"gallbladder_tip", 7, 3.2, 1.5, 0.1},
        StaticCase{"gallbladder_tip_large", 7, 2.6, 1.3, 0.1}, StaticCase{"gallbladder_mid", 7, 2.9, 1.35, 0.1},
        StaticCase{"gallbladder_axial", 7, 9, 3.4, 0.7}, StaticCase{"gallbladder_torsion", 7, 11, 3.3, 0.1},
        StaticCase{"gallbladder_twist", 7, 3.8, 1.8, 0.1}, StaticCase{"gallbladder_poke_small", 7, 36.2, 8.2, 0.13},
        StaticCase{"gallbladder_poke_large", 7, 31, 11.4, 0.41}, StaticCase{"liver_tip", 35, 14.8, 6.7, 0.1},
        StaticCase{"cylinder_tip_large", 25, 2.3, 1.25, 0.1}, StaticCase{"gallbladder_tip_large", 25, 6, 3, 0.24},
        StaticCase{"liver_tip_in_plane", 35, 17, 9.9, 0.2}, StaticCase{"liver_mid", 35, 27.3, 10.9, 0.4},
        StaticCase{"liver_axial", 35, 31.6, 17.7, 1.3}, StaticCase{"liver_torsion", 35, 27, 8.6, 0.1},
        StaticCase{"liver_poke_small", 35, 30.7, 4.7, 0.4}, StaticCase{"liver_poke_large", 35, 34.7, 7.4, 1},
        StaticCase{"gallbladder_doubled_tip_large", 7, 2.5, 1.2, 0.1}),
    nameOf);

#define KIDNEY_ROOT "vertices=" MEDULLA_SOURCE_DIR "/tests/accuracy/results/kidney_root.fix.csv"
#define STRETCHED_ROOT "vertices=" MEDULLA_SOURCE_DIR "/tests/accuracy/results/liver_stretched_root.fix.csv"
#define CUBE_ROOT "vertices=" MEDULLA_SOURCE_DIR "/tests/accuracy/results/cube_root.fix.csv"
#define STOMACH_ROOT "vertices=" MEDULLA_SOURCE_DIR "/tests/accuracy/results/stomach_root.fix.csv"
#define CYLINDER_ROOT "vertices=" MEDULLA_SOURCE_DIR "/tests/accuracy/results/cylinder_root.fix.csv"
#define CYLINDER_BED "vertices=" MEDULLA_SOURCE_DIR "/tests/accuracy/results/cylinder_bed.fix.csv"
#define PEAR_ROOT "plane=-0.4887,-0.6834,0.5423,0.024"
#define PEAR_BED "vertices=" MEDULLA_SOURCE_DIR "/tests/accuracy/results/gallbladder_bed.fix.csv"
INSTANTIATE_TEST_SUITE_P(Identified, StaticAccuracy,
                         testing::Values(StaticCase{"cylinder_tip", 7, 0.16, 0.09, 0.1, CYLINDER_ROOT},
                                         StaticCase{"cylinder_tip_large", 7, 0.2, 0.1, 0.05, CYLINDER_ROOT},
                                         StaticCase{"cylinder_tip_large", 25, 0.28, 0.18, 0.05, CYLINDER_ROOT},
                                         StaticCase{"cylinder_mid", 7, 0.38, 0.17, 0.05, CYLINDER_ROOT},
                                         StaticCase{"cylinder_torsion", 7, 1.3, 0.56, 0.05, CYLINDER_ROOT},
                                         StaticCase{"cylinder_axial", 7, 2.2, 1.1, 0.15, CYLINDER_ROOT},
                                         StaticCase{"cylinder_poke_small", 25, 20, 3.3, 0.15, CYLINDER_BED},
                                         StaticCase{"cylinder_poke_large", 25, 19.5, 4.4, 0.3, CYLINDER_BED},
                                         StaticCase{"gallbladder_tip", 7, 0.6, 0.26, 0.1, PEAR_ROOT},
                                         StaticCase{"gallbladder_tip_large", 7, 0.76, 0.24, 0.08, PEAR_ROOT},
                                         StaticCase{"gallbladder_mid", 7, 0.86, 0.3, 0.09, PEAR_ROOT},
                                         StaticCase{"gallbladder_torsion", 7, 6.7, 2.15, 0.05, PEAR_ROOT},
                                         StaticCase{"gallbladder_twist", 7, 1.65, 0.73, 0.08, PEAR_ROOT},
                                         StaticCase{"gallbladder_axial", 7, 10, 2.4, 0.25, PEAR_ROOT},
                                         StaticCase{"gallbladder_poke_small", 25, 29.5, 5.7, 0.15, PEAR_BED},
                                         StaticCase{"gallbladder_poke_large", 25, 18, 5.6, 0.35, PEAR_BED}),
                         nameOf);

// Meshes that the program's own shapes do not come in: the same organs stretched and remeshed, and a kidney; an arch
// with narrow ends; a cube under loads of half of Young's modulus and more.
INSTANTIATE_TEST_SUITE_P(OfOtherMeshes, StaticAccuracy,
                         testing::Values(StaticCase{"liver_stretched_tip", 20, 1.2, 0.28, 0.1, STRETCHED_ROOT},
                                         StaticCase{"liver_stretched_axial", 20, 3.5, 0.9, 0.1, STRETCHED_ROOT},
                                         StaticCase{"gallbladder_halved_tip_large", 7, 2.45, 1.3, 0.08, PEAR_ROOT},
                                         StaticCase{"gallbladder_halved_pull", 7, 5.4, 1.48, 0.1, PEAR_ROOT},
                                         StaticCase{"gallbladder_doubled_tip_large", 7, 0.72, 0.31, 0.08, PEAR_ROOT},
                                         StaticCase{"gallbladder_doubled_pull", 7, 1.65, 0.7, 0.1, PEAR_ROOT},
                                         StaticCase{"kidney_tip", 20, 3.4, 1.5, 0.1, KIDNEY_ROOT},
                                         StaticCase{"stomach_pull", 25, 0.6, 0.22, 0.1, STOMACH_ROOT},
                                         StaticCase{"cube_pull", 9, 15.7, 5.6, 0.7, CUBE_ROOT},
                                         StaticCase{"cube_pull_far", 9, 33, 6.2, 4.9, CUBE_ROOT},
                                         StaticCase{"cube_shear", 9, 10.9, 5.3, 1.2, CUBE_ROOT}),
                         nameOf);

// Bending in both planes, torsion, second bending in both planes; then stretch. The surface swings along.
TEST(DynamicAccuracy, TheCylindersModesAreThoseOfFiniteElements) {
  const Result result = readResult("cylinder_modes");
  BodyDescription body = bodyOf(readResult("cylinder_tip"), modelOf(result, 7), 0, 0);
  const std::vector<double> found = naturalFrequencies(body, bodyMechanics(body), 8),
                            expected = result.numbers("frequencies");
  ASSERT_EQ(found.size(), 8u);
  EXPECT_NEAR(found[0] / expected[0], 1, 0.005);
  for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k] / expected[k], 1, 0.015) << k;
}

// The same of links that finite elements identify: of the cylinder eight, of the gallbladder five.
class ModalAccuracy : public testing::TestWithParam<StaticCase> {};

TEST_P(ModalAccuracy, FrequenciesAreThoseOfFiniteElements) {
  const Result tip = readResult(GetParam().name), modes = readResult(tip.text("body") + "_modes");
  const BodyDescription body = bodyOf(GetParam(), tip);
  const std::vector<double> expected = modes.numbers("frequencies"),
                            found = naturalFrequencies(body, bodyMechanics(body), static_cast<int>(expected.size()));
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k] / expected[k], 1, 0.03) << k;
}

INSTANTIATE_TEST_SUITE_P(Identified, ModalAccuracy,
                         testing::Values(StaticCase{"cylinder_tip", 7, 0, 0, 0, CYLINDER_ROOT},
                                         StaticCase{"gallbladder_tip", 7, 0, 0, 0, PEAR_ROOT}),
                         [](const auto& tested) { return std::string(tested.param.name); });

// The loaded vertices' mean displacement along the load swings about where it ends: its extremes give the first mode's
// frequency and damping ratio.
TEST(DynamicAccuracy, TheCylinderSwingsAndDecaysAsInFiniteElements) {
  const Result result = readResult("cylinder_step");
  const double expected = result.number("frequencies");
  BodyDescription body = bodyOf(result, modelOf(result, 7), 0, 0);
  body.tissue.damping = 0.05;
  World world = worldOf(body);
  const Vector3d along = result.vector("force").normalized();
  std::vector<double> place;
  DynamicsFrame frame;
  while (world.time() < 12 / expected) {
    world.advance({});
    world.readFrame(frame);
    double sum = 0;
    for (const DeadLoad& load : body.deadLoads) {
      sum += (frame.bodies[0].nodes[load.node] - body.model->restNodes[load.node]).dot(along);
    }
    place.push_back(sum / static_cast<double>(body.deadLoads.size()));
  }
  // Turning points, each by the parabola through three frames; the first two hold higher modes.
  std::vector<double> time, value;
  for (std::size_t i = 1; i + 1 < place.size(); ++i) {
    const double before = place[i] - place[i - 1], after = place[i + 1] - place[i];
    if (before * after > 0) continue;
    const double shift = 0.5 * (before + after) / (before - after);
    time.push_back(static_cast<double>(i) + shift);
    value.push_back(place[i] + 0.25 * (before + after) * shift);
  }
  ASSERT_GE(value.size(), 9u);
  const double halfPeriod = (time[8] - time[2]) / 6 * 0.02;
  const double decay = std::log((value[2] - value[3]) / (value[6] - value[7])) / 4;
  const double zeta = decay / std::hypot(decay, std::numbers::pi);
  const double frequency = 0.5 / halfPeriod / std::sqrt(1 - zeta * zeta);
  EXPECT_NEAR(frequency / expected, 1, 0.005);
  EXPECT_NEAR(zeta / 0.05, 1, 0.05);
}

}  // namespace
}  // namespace medulla
