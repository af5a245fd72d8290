#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

#include "physics/model/attachment.h"
#include "physics/model/ball_choice.h"
#include "physics/model/build.h"
#include "physics/model/build_report.h"
#include "physics/model/identify/necks.h"
#include "physics/model/node_volumes.h"
#include "physics/model/symmetric_eigen.h"
#include "tests/complaint.h"
#include "tests/test_shapes.h"

namespace medulla {

using Eigen::Vector3d;

static SoftBodyModel build(const TriangleMesh& mesh, const BuildSettings& settings, BuildReport& report) {
  return buildModel(asRepaired(mesh), nullptr, settings, report);
}

TEST(MassProperties, BoxFarFromTheOrigin) {
  const Vector3d at(100, -50, 20), size(1, 2, 3);
  TriangleMesh mesh = boxMesh(size);
  for (Vector3d& x : mesh.vertices) x += at;
  const MassProperties m = massProperties(mesh);
  EXPECT_NEAR(m.volume, 6, 1e-10);
  EXPECT_LT((m.centroid - at - size / 2).norm(), 1e-10);
  const Vector3d expected = 6. / 12 * size.cwiseProduct(size);
  EXPECT_LT((m.secondMoment - Eigen::Matrix3d(expected.asDiagonal())).norm(), 1e-9);
}

TEST(LinkSections, StraightTubeGivesItsBeam) {
  const double radius = 0.01, pi = std::numbers::pi;
  BuildSettings settings;
  settings.spheres = 5;
  BuildReport report;
  const SoftBodyModel model = build(cylinderMesh(0.1, radius, 48, 60), settings, report);
  const double polygon = 48 / (2 * pi) * std::sin(2 * pi / 48);  // area of the 48-gon over that of the circle
  for (const ElasticLink& link : model.links) {
    for (const LinkSection& s : link.sections) {
      EXPECT_NEAR(s.area / (polygon * pi * radius * radius), 1, 0.01);
      EXPECT_NEAR(s.bendingMomentU / (pi * std::pow(radius, 4) / 4), 1, 0.03);
      EXPECT_NEAR(s.bendingMomentV / (pi * std::pow(radius, 4) / 4), 1, 0.03);
      EXPECT_NEAR(s.torsionConstant / (pi * std::pow(radius, 4) / 2), 1, 0.03);
    }
    const Vector3d line = model.spheres[link.sphere1].restLinkEnd - model.spheres[link.sphere0].restLinkEnd;
    EXPECT_NEAR(link.restU.norm(), 1, 1e-12);
    EXPECT_NEAR(link.restU.dot(line.normalized()), 0, 1e-12);
  }
}

// Two blocks and a bar between them with less than a hundredth of their section.
static TriangleMesh dumbbell(double neckRadius) {
  TriangleMesh mesh = cylinderMesh(0.08, 1, 24, 80);
  for (Vector3d& x : mesh.vertices) {
    const bool inNeck = x.x() > 0.0305 && x.x() < 0.0495;
    x.tail<2>() *= inNeck ? neckRadius : 0.015;
  }
  return mesh;
}

TEST(LinkSections, ANeckIsNoGap) {
  const double radius = 0.0008, pi = std::numbers::pi;
  BuildSettings settings;
  settings.spheres = 2;
  BuildReport report;
  const SoftBodyModel model = build(dumbbell(radius), settings, report);
  ASSERT_EQ(model.links.size(), 1u);
  double least = 1;
  for (const LinkSection& s : model.links[0].sections) least = std::min(least, s.area);
  EXPECT_GT(least, 0.75 * pi * radius * radius);  // less by the steepest taper: its blocks are beside it
  EXPECT_LT(least, 1.02 * pi * radius * radius);
}

TEST(Necks, TheNarrowestIsFoundWhereItIs) {
  for (const double radius : {0.0008, 0.002, 0.003}) {
    const auto neck = narrowestNeck(dumbbell(radius), 0.0066, 0.02);
    ASSERT_TRUE(neck.has_value()) << radius;
    EXPECT_NEAR(neck->width / (2 * radius), 1, 0.1);
    EXPECT_GT(neck->place.x(), 0.03);
    EXPECT_LT(neck->place.x(), 0.05);
    EXPECT_LT(neck->place.tail<2>().norm(), radius);
  }
  EXPECT_FALSE(narrowestNeck(dumbbell(0.004), 0.0066, 0.02).has_value());
  EXPECT_FALSE(narrowestNeck(dumbbell(0.002), 0.0066, 0.6).has_value());  // no part is as large
  EXPECT_FALSE(narrowestNeck(cylinderMesh(0.1, 0.01, 24, 20), 0.0066, 0.02).has_value());
}

TEST(BuildReportTest, ConeOfTwoBalls) {
  const Ball a{{0, 0, 0}, 1}, b{{4, 0, 0}, 1}, point{{4, 0, 0}, 0};
  EXPECT_NEAR(signedDistanceToCone({2, 3, 0}, a, b), 2, 1e-12);
  EXPECT_NEAR(signedDistanceToCone({-3, 0, 0}, a, b), 2, 1e-12);
  EXPECT_NEAR(signedDistanceToCone({2, 0, 0}, a, b), -1, 1e-12);
  EXPECT_NEAR(signedDistanceToCone({0.25, std::sqrt(1 - 1. / 16), 0}, a, point), 0, 1e-12);  // the tangent's end
}

// What a model promises whatever it was made from.
static void expectSound(const SoftBodyModel& model, const BuildReport& report) {
  EXPECT_EQ(report.components, 1);
  EXPECT_LE(report.massError, 0.1);
  EXPECT_LE(report.centreError, 0.1);
  EXPECT_LE(report.inertiaError, 0.5);
  std::vector<int> owners(model.triangles.size(), 0);
  ASSERT_EQ(model.buckets.size(), model.spheres.size());
  for (const auto& bucket : model.buckets) {
    for (const int t : bucket) ++owners[t];
  }
  for (const int count : owners) EXPECT_EQ(count, 1);
  ASSERT_EQ(model.attachments.size(), model.restNodes.size());
  for (std::size_t n = 0; n < model.attachments.size(); ++n) {
    const Attachment& a = model.attachments[n];
    EXPECT_GT(a.volume, 0);
    EXPECT_GT(a.area, 0);
    EXPECT_LT((restAnchor(a, model.spheres, model.links) + a.restOffset - model.restNodes[n]).norm(), 1e-12);
    if (!a.onLink) continue;
    EXPECT_GT(a.along, 0);
    EXPECT_LT(a.along, 1);
    const ElasticLink& link = model.links[a.host];
    const Vector3d line = model.spheres[link.sphere1].restLinkEnd - model.spheres[link.sphere0].restLinkEnd;
    EXPECT_NEAR(a.restOffset.dot(line.normalized()), 0, 1e-12);
  }
  for (const ElasticLink& link : model.links) {
    EXPECT_LT(link.sphere0, link.sphere1);
    for (const LinkSection& s : link.sections)
      EXPECT_GT(std::min({s.area, s.bendingMomentU, s.bendingMomentV, s.torsionConstant}), 0);
  }
  for (const MassProperties& s : remainingSpheres(model.restNodes, model.spheres, model.attachments)) {
    EXPECT_GT(s.volume, 0);
    EXPECT_GT(symmetricEigen(s.secondMoment).values[0], 0);
  }
}

// A layer of one stiffness per area and no edges: nodes of a cell weigh by their areas, and the body as before.
TEST(NodeVolumes, SharedByTheLayerTheBodyStaysItself) {
  BuildReport report;
  BuildSettings settings;
  settings.renderLevels = 0;
  const SoftBodyModel before = build(assetMesh("gallbladder/gallbladder.obj"), settings, report);
  SoftBodyModel model = before;
  shareOutMassByLayer({100, 50, 0}, settings.surfaceMassFraction, model);
  std::vector<double> least(model.spheres.size(), 1e9), most(model.spheres.size(), 0);
  for (std::size_t n = 0; n < model.attachments.size(); ++n) {
    const Attachment &a = model.attachments[n], &old = before.attachments[n];
    EXPECT_EQ(a.massSphere, old.massSphere);
    EXPECT_EQ(a.host, old.host);
    EXPECT_NEAR(a.along, old.along, 1e-12);
    least[a.massSphere] = std::min(least[a.massSphere], a.volume / a.area);
    most[a.massSphere] = std::max(most[a.massSphere], a.volume / a.area);
    EXPECT_LT((restAnchor(a, model.spheres, model.links) + a.restOffset - model.restNodes[n]).norm(), 1e-15);
  }
  for (std::size_t i = 0; i < model.spheres.size(); ++i) {
    EXPECT_GT(least[i], 0);
    EXPECT_NEAR(most[i] / least[i], 1, 1e-12);
    EXPECT_EQ(model.spheres[i].restLinkEnd, before.spheres[i].restLinkEnd);
    EXPECT_GT((model.spheres[i].restFrame - before.spheres[i].restFrame).norm(), 0);
  }
  const std::vector<MassProperties> spheres = remainingSpheres(model.restNodes, model.spheres, model.attachments);
  for (const MassProperties& s : spheres) EXPECT_GT(symmetricEigen(s.secondMoment).values[0], 0);
  const MassProperties total = totalOf(spheres, model.restNodes, model.attachments),
                       exact = massProperties({model.restNodes, model.triangles});
  EXPECT_NEAR(total.volume / exact.volume, 1, 1e-9);
  EXPECT_LT((total.centroid - exact.centroid).norm(), 1e-9);
  EXPECT_LT((total.secondMoment - exact.secondMoment).norm(), 1e-6 * exact.secondMoment.norm());
  const SoftBodyModel once = model, skin = withoutNodeVolumes(model);
  const MassProperties carried =
      totalOf(remainingSpheres(skin.restNodes, skin.spheres, skin.attachments), skin.restNodes, skin.attachments);
  EXPECT_LT((carried.centroid - exact.centroid).norm(), 1e-9);
  EXPECT_LT((carried.secondMoment - exact.secondMoment).norm(), 1e-6 * exact.secondMoment.norm());
  for (std::size_t n = 0; n < skin.attachments.size(); ++n) {
    EXPECT_EQ(skin.attachments[n].volume, 0);
    const Eigen::Vector3d place =
        restAnchor(skin.attachments[n], skin.spheres, skin.links) + skin.attachments[n].restOffset;
    EXPECT_LT((place - skin.restNodes[n]).norm(), 1e-12);
  }
  shareOutMassByLayer({100, 50, 0}, settings.surfaceMassFraction, model);
  for (std::size_t n = 0; n < model.attachments.size(); ++n)
    EXPECT_NEAR(model.attachments[n].volume / once.attachments[n].volume, 1, 1e-9);
}

TEST(ModelBuild, GallbladderOfSevenSpheres) {
  BuildReport report;
  const SoftBodyModel model = build(assetMesh("gallbladder/gallbladder.obj"), {}, report);
  expectSound(model, report);
  EXPECT_EQ(report.spheres, 7);
  EXPECT_GE(report.links, 6);
  EXPECT_LE(report.links, 7);
  EXPECT_EQ(report.triangles, 466);
  EXPECT_EQ(report.centresOutside, 0);
  EXPECT_EQ(report.attachmentsCrossing, 0);
  EXPECT_LE(report.gapMax, 3.5);
  EXPECT_GE(report.cover, 75);
  EXPECT_GE(report.coverCones, report.cover);
  EXPECT_LE(report.gapConesMax, report.gapMax);
}

TEST(ModelBuild, BallsAreInscribedWithoutAnOvershoot) {
  const TriangleMesh mesh = assetMesh("gallbladder/gallbladder.obj");
  BuildReport report;
  BuildSettings settings;
  settings.spheres = 25;
  settings.overshoot = 0;
  const SoftBodyModel model = build(mesh, settings, report);
  expectSound(model, report);
  EXPECT_EQ(report.spheres, 25);
  EXPECT_LE(report.gapMax, 1.4);
  EXPECT_GE(report.cover, 95);
  EXPECT_EQ(report.attachmentsCrossing, 0);
  const SurfaceTree tree = makeSurfaceTree(mesh);
  for (const FillingSphere& s : model.spheres) {
    EXPECT_LE(s.radius, inscribedRadius(tree, s.restBallCentre) * (1 + 1e-9));
  }
}

// Largest gap and share of the volume in balls, %, that models of the project's own bodies keep.
struct Filling {
  const char* mesh;
  int spheres;
  double gap, cover;
};

TEST(ModelBuild, BallsFillAndStickOutNoFurtherThanAllowed) {
  for (const Filling& f : {Filling{"gallbladder/gallbladder.obj", 7, 3.5, 87},
                           {"gallbladder/gallbladder.obj", 25, 1.4, 95},
                           {"gallbladder/gallbladder.obj", 100, 0.8, 97},
                           {"stomach/stomach.obj", 7, 7, 70},
                           {"stomach/stomach.obj", 25, 1.2, 95},
                           {"liver/liver.obj", 7, 10, 63},
                           {"liver/liver.obj", 25, 4.2, 84},
                           {"liver/liver.obj", 50, 2.5, 91},
                           {"dolphin/dolphin.obj", 6, 13, 45},
                           {"dolphin/dolphin.obj", 25, 4.2, 81}}) {
    SCOPED_TRACE(std::string(f.mesh) + " " + std::to_string(f.spheres));
    BuildSettings settings;
    settings.spheres = f.spheres;
    BuildReport report;
    const SoftBodyModel model = build(assetMesh(f.mesh), settings, report);
    expectSound(model, report);
    EXPECT_EQ(report.spheres, f.spheres);
    EXPECT_LE(report.overshootMax, overshootOf(settings) * (1 + 1e-9));
    EXPECT_LE(report.gapMax, f.gap);
    EXPECT_GE(report.cover, f.cover);
    EXPECT_EQ(report.centresOutside, 0);
    if (f.spheres >= 25) {
      EXPECT_EQ(report.attachmentsCrossing, 0);
    }
  }
}

TEST(ModelBuild, SpheresOfSeveralBodiesAreSharedByTheGapInMetres) {
  const TriangleMesh large = ellipsoidMesh(2, {0.03, 0.03, 0.09}), small = ellipsoidMesh(2, {0.01, 0.01, 0.03});
  const std::vector<BodyShape> shapes{measureShape(large, 0), measureShape(small, 0)};
  EXPECT_EQ(shareSpheres(shapes, 2), (std::vector<int>{1, 1}));
  // More than set cover can use, with overshoots: one in turn to each.
  const std::vector<BodyShape> standingOut{measureShape(large, 2), measureShape(small, 2)};
  for (const int many : {600, 1501}) {
    const std::vector<int> dealt = shareSpheres(standingOut, many);
    EXPECT_EQ(dealt[0] + dealt[1], many);
  }
  const std::vector<int> counts = shareSpheres(shapes, 15);
  EXPECT_EQ(counts[0] + counts[1], 15);
  double gaps[2];
  for (int b = 0; b < 2; ++b)
    gaps[b] = largestGap(shapes[b], chooseBalls(shapes[b], counts[b], CoverGoal::gap)) * shapes[b].diagonal;
  EXPECT_NEAR(gaps[0] / gaps[1], 1, 0.3);
  EXPECT_THROW(shareSpheres(shapes, 1), std::runtime_error);
}

// A ring in the plane of x and z.
static TriangleMesh torusMesh(double ringRadius, double tubeRadius, int around, int across) {
  constexpr double pi = std::numbers::pi;
  TriangleMesh mesh;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double a = 2 * pi * i / around, b = 2 * pi * j / across, r = ringRadius + tubeRadius * std::cos(b);
      mesh.vertices.emplace_back(r * std::cos(a), tubeRadius * std::sin(b), -r * std::sin(a));
      const int i1 = (i + 1) % around, j1 = (j + 1) % across;
      const int p = i * across + j, q = i1 * across + j, u = i1 * across + j1, v = i * across + j1;
      mesh.triangles.push_back({p, q, u});
      mesh.triangles.push_back({p, u, v});
    }
  }
  return mesh;
}

TEST(ModelBuild, RingStaysClosed) {
  const TriangleMesh mesh = torusMesh(0.05, 0.01, 48, 16);
  BuildReport report;
  BuildSettings settings;
  settings.spheres = 12;
  const SoftBodyModel model = build(mesh, settings, report);
  expectSound(model, report);
  EXPECT_EQ(report.links, 12);
  EXPECT_EQ(report.degreeMax, 2);
  EXPECT_EQ(report.attachmentsCrossing, 0);
  settings.method = BuildMethod::skeleton;
  const SoftBodyModel skeleton = build(mesh, settings, report);
  EXPECT_EQ(report.components, 1);
  EXPECT_GE(report.links, report.spheres);
}

// Straight links between neighbours leave so thin a ring, the last as the others: without it the ring was an open C,
// ten times as soft.
TEST(ModelBuild, ARingThatItsLinksLeaveIsClosed) {
  BuildReport report;
  BuildSettings settings;
  settings.spheres = 9;
  build(torusMesh(0.1, 0.008, 64, 12), settings, report);
  EXPECT_EQ(report.links, 9);
  EXPECT_EQ(report.degreeMax, 2);
}

TEST(ModelBuild, ThinPlatesWorkOrAreRefused) {
  const auto plate = [](double thickness) {
    TriangleMesh mesh = ellipsoidMesh(4, {1, 1, 1});
    for (Vector3d& v : mesh.vertices) {  // the superellipsoid of a rounded square plate
      const double n = std::pow(std::pow(v.x(), 6) + std::pow(v.z(), 6) + std::pow(v.y(), 6), 1 / 6.);
      v = (v / n).cwiseProduct(Vector3d(0.05, thickness / 2, 0.05));
    }
    return mesh;
  };
  BuildReport report;
  BuildSettings settings;
  settings.spheres = 60;
  const SoftBodyModel model = build(plate(0.004), settings, report);
  expectSound(model, report);
  EXPECT_EQ(report.centresOutside, 0);
  const std::string complaint = complaintOf([&] { build(plate(0.0006), settings, report); });
  EXPECT_NE(complaint.find("too thin"), std::string::npos) << complaint;
}

TEST(ModelBuild, FewestSpheresForAGap) {
  const TriangleMesh mesh = assetMesh("gallbladder/gallbladder.obj");
  BuildReport report;
  BuildSettings settings;
  settings.gap = 4.5;
  const SoftBodyModel model = build(mesh, settings, report);
  expectSound(model, report);
  EXPECT_LE(report.gapMax, 4.5);
  settings.gap = 0;
  settings.spheres = report.spheres - 2;
  build(mesh, settings, report);
  EXPECT_GT(report.gapMax, 4.5);
  // No ball reaches into corners.
  EXPECT_THROW(fewestBalls(measureShape(cylinderMesh(0.1, 0.01, 12, 10), 0), 0.01, 100), std::runtime_error);
}

TEST(ModelBuild, SkeletonMethodKeepsThePapersResult) {
  BuildReport report;
  BuildSettings settings;
  settings.method = BuildMethod::skeleton;
  const SoftBodyModel model = build(assetMesh("gallbladder/gallbladder.obj"), settings, report);
  expectSound(model, report);
  EXPECT_EQ(report.spheres, report.skeletonNodes);
  EXPECT_EQ(report.links, report.skeletonLinks);
}

TEST(ModelBuild, OneSphereAndAPlainBall) {
  BuildReport report;
  BuildSettings settings;
  settings.spheres = 1;
  const SoftBodyModel model = build(ellipsoidMesh(3, {0.02, 0.02, 0.02}), settings, report);
  expectSound(model, report);
  EXPECT_TRUE(model.links.empty());
  EXPECT_LT(report.gapMax, 1);
  EXPECT_GT(report.cover, 96);
  EXPECT_LT(model.spheres[0].restFrame.norm(), 1e-5);
}

TEST(ModelBuild, WithoutSurfaceMassFramesAreCentroids) {
  BuildReport report;
  BuildSettings settings;
  settings.surfaceMassFraction = 0;
  const SoftBodyModel model = build(assetMesh("gallbladder/gallbladder.obj"), settings, report);
  for (const Attachment& a : model.attachments) EXPECT_EQ(a.volume, 0);
  EXPECT_LE(report.inertiaError, 1e-6);
}

template <typename T>
static void expectSameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0);
}

TEST(ModelBuild, TwoBuildsAreEqualToTheByte) {
  const TriangleMesh mesh = assetMesh("gallbladder/gallbladder.obj");
  BuildReport report;
  const SoftBodyModel a = build(mesh, {}, report), b = build(mesh, {}, report);
  EXPECT_EQ(a.meshHash, b.meshHash);
  EXPECT_EQ(a.settings, b.settings);
  expectSameBytes(a.restNodes, b.restNodes);
  expectSameBytes(a.triangles, b.triangles);
  expectSameBytes(a.edges, b.edges);
  expectSameBytes(a.skeleton.nodes, b.skeleton.nodes);
  expectSameBytes(a.skeleton.links, b.skeleton.links);
  expectSameBytes(a.spheres, b.spheres);
  EXPECT_EQ(a.buckets, b.buckets);
  ASSERT_EQ(a.links.size(), b.links.size());
  for (std::size_t k = 0; k < a.links.size(); ++k) {  // field by field: padding bytes are nobody's
    EXPECT_EQ(a.links[k].sphere0, b.links[k].sphere0);
    EXPECT_EQ(a.links[k].sphere1, b.links[k].sphere1);
    for (int s = 0; s < ElasticLink::kSections; ++s) {
      EXPECT_EQ(a.links[k].sections[s].area, b.links[k].sections[s].area);
      EXPECT_EQ(a.links[k].sections[s].bendingMomentU, b.links[k].sections[s].bendingMomentU);
      EXPECT_EQ(a.links[k].sections[s].bendingMomentV, b.links[k].sections[s].bendingMomentV);
      EXPECT_EQ(a.links[k].sections[s].torsionConstant, b.links[k].sections[s].torsionConstant);
    }
    EXPECT_EQ(a.links[k].restU, b.links[k].restU);
  }
  ASSERT_EQ(a.attachments.size(), b.attachments.size());
  for (std::size_t k = 0; k < a.attachments.size(); ++k) {
    EXPECT_EQ(a.attachments[k].onLink, b.attachments[k].onLink);
    EXPECT_EQ(a.attachments[k].host, b.attachments[k].host);
    EXPECT_EQ(a.attachments[k].along, b.attachments[k].along);
    EXPECT_EQ(a.attachments[k].restOffset, b.attachments[k].restOffset);
    EXPECT_EQ(a.attachments[k].area, b.attachments[k].area);
    EXPECT_EQ(a.attachments[k].volume, b.attachments[k].volume);
  }
  expectSameBytes(a.renderSurface.first, b.renderSurface.first);
  expectSameBytes(a.renderSurface.node, b.renderSurface.node);
  expectSameBytes(a.renderSurface.weight, b.renderSurface.weight);
  expectSameBytes(a.renderSurface.tangent0, b.renderSurface.tangent0);
  expectSameBytes(a.renderSurface.tangent1, b.renderSurface.tangent1);
  expectSameBytes(a.renderSurface.offset, b.renderSurface.offset);
  expectSameBytes(a.renderSurface.restPosition, b.renderSurface.restPosition);
  expectSameBytes(a.renderSurface.triangles, b.renderSurface.triangles);
}

TEST(ModelBuild, ProgressRisesToOne) {
  std::vector<double> steps;
  BuildReport report;
  buildModel(asRepaired(assetMesh("gallbladder/gallbladder.obj")), nullptr, {}, report,
             [&](double done) { steps.push_back(done); });
  ASSERT_GE(steps.size(), 5u);
  for (std::size_t k = 1; k < steps.size(); ++k) EXPECT_GE(steps[k], steps[k - 1]);
  EXPECT_EQ(steps.back(), 1);
}

TEST(ModelBuild, RefusesSettingsOutOfRange) {
  const RepairedMesh mesh = asRepaired(ellipsoidMesh(1, {1, 1, 1}));
  BuildReport report;
  BuildSettings settings;
  settings.spheres = 0;
  EXPECT_THROW(buildModel(mesh, nullptr, settings, report), std::runtime_error);
  settings = {};
  settings.surfaceMassFraction = 0.5;
  EXPECT_THROW(buildModel(mesh, nullptr, settings, report), std::runtime_error);
  settings = {};
  settings.renderLevels = 5;
  EXPECT_THROW(buildModel(mesh, nullptr, settings, report), std::runtime_error);
  EXPECT_THROW(buildModel(RepairedMesh{}, nullptr, {}, report), std::runtime_error);
}

TEST(Buckets, MajorityThenLowerSphere) {
  std::vector<Attachment> nodes(4);
  for (int n = 0; n < 4; ++n) nodes[n].host = n % 3;  // on spheres 0, 1, 2, 0
  std::vector<ElasticLink> links(1);
  links[0].sphere0 = 1;
  links[0].sphere1 = 2;
  Attachment onLink;
  onLink.onLink = true;
  onLink.along = 0.7;
  nodes.push_back(onLink);  // node 4: nearer to sphere 2
  const auto buckets = fillBuckets({{0, 1, 2}, {0, 1, 3}, {1, 2, 4}}, nodes, 3, links);
  EXPECT_EQ(buckets[0], (std::vector<int>{0, 1}));
  EXPECT_TRUE(buckets[1].empty());
  EXPECT_EQ(buckets[2], (std::vector<int>{2}));
}

}  // namespace medulla
