#include "app/files/model_file.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cstring>

#include "app/files/text_file.h"
#include "tests/complaint.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

// A tetrahedron with two spheres and a link: small enough to read its file, with numbers that are awkward as text.
SoftBodyModel smallModel() {
  SoftBodyModel m;
  m.name = "a <b> & \"c\"";
  m.meshHash = 0xfedcba9876543210;
  m.settings = "medulla build tetrahedron.obj --spheres 2";
  m.nodeOfInputVertex = {0, 1, -1, 2, 3, 0};
  m.restNodes = {{0, 0, 0}, {0.1 + 0.2, -0.0, 1e-300}, {0, 1. / 3, 0}, {0, 5e-324, 1 + DBL_EPSILON}};
  m.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  m.edges = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  const Eigen::Matrix3d moment = Eigen::Vector3d(1e-11 / 3, 2e-11, 3e-11).asDiagonal();
  m.spheres = {{{0.1, 0.1, 0.1}, 0.05, {0.1, 0.2, 0}, {0.1, 0.25, 0}, 1e-5 / 7, moment},
               {{0.1, 0.1, 0.6}, 0.01, {0.1, 0.2, 0.5}, {0.1, 0.25, 1. / 3}, 2e-5, 2 * moment}};
  m.links = {{0, 1, {}, Eigen::Vector3d(std::sqrt(0.5), std::sqrt(0.5), 0)}};
  m.links[0].sections.fill({1e-4 / 3, 2e-9, 4e-9, 3e-9});
  m.links[0].sections.front().area = 1e-4;
  m.links[0].sections[1].bendingMomentU = 1e-9;
  m.attachments = {{false, 0, 0, {-0.1, -0.2, 0}, 1e-3, 1e-7},
                   {true, 0, 0.25, {0.2, -0.2, 0}, 1e-3, 0},
                   {true, 0, 1, {0, 0.1, 0}, 1e-3, 1e-7},
                   {false, 1, 0, {-0.1, -0.2, 0.5}, 1e-3, 1e-7}};
  m.buckets = {{0, 3}, {1, 2}};
  m.skeleton = {{{0, 0, 0.1}, {0, 0, 0.9}}, {{0, 1}}};
  RenderSurface& s = m.renderSurface;
  s.first = {0, 2, 3, 5};
  s.node = {0, 1, 2, 0, 3};
  s.weight = {0.1f, 0.9f, 1, FLT_MIN, 1.f / 3};
  s.tangent0 = {1, -1, -0.0f, 1e-45f, 16777216};
  s.tangent1 = {0, 1, 2, 3, FLT_MAX};
  s.offset = {{0, 0, 0}, {0.1f, 0, -0.1f}, {0, 0, 0}};
  s.restPosition = {{0, 0, 0}, {0.3f, 0, 0}, {0, 0.3f, 1}};
  s.triangles = {{0, 1, 2}};
  return m;
}

template <typename T>
bool sameBits(const T& a, const T& b) {
  if constexpr (std::is_arithmetic_v<T>) {
    // Bits on purpose: -0 and 0 differ, and so would two NaN that == calls different.
    return std::memcmp(&a, &b, sizeof(T)) == 0;  // NOLINT(bugprone-suspicious-memory-comparison)
  } else {
    return std::equal(a.data(), a.data() + a.size(), b.data(), b.data() + b.size(),
                      [](const auto& x, const auto& y) { return sameBits(x, y); });
  }
}

class ModelFile : public testing::Test {
 protected:
  std::string textOf(const SoftBodyModel& model) const {
    writeModel(temporary / "m.xml", model);
    return readTextFile(temporary / "m.xml");
  }
  SoftBodyModel read(const std::string& text) const {
    temporary.write("m.xml", text);
    return readModel(temporary / "m.xml");
  }
  // The complaint, without the folder; empty where there is none.
  std::string complaint(const std::string& text) const {
    return complaintOf([&] { read(text); }, temporary.path());
  }

  TemporaryFolder temporary;
};

TEST_F(ModelFile, ReadingGivesTheSameBits) {
  const SoftBodyModel a = smallModel(), b = read(textOf(a));
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.meshHash, b.meshHash);
  EXPECT_EQ(a.settings, b.settings);
  EXPECT_EQ(a.nodeOfInputVertex, b.nodeOfInputVertex);
  EXPECT_TRUE(sameBits(a.restNodes, b.restNodes));
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.edges, b.edges);
  ASSERT_EQ(a.spheres.size(), b.spheres.size());
  for (std::size_t k = 0; k < a.spheres.size(); ++k) {
    EXPECT_TRUE(sameBits(a.spheres[k].restBallCentre, b.spheres[k].restBallCentre));
    EXPECT_TRUE(sameBits(a.spheres[k].radius, b.spheres[k].radius));
    EXPECT_TRUE(sameBits(a.spheres[k].restFrame, b.spheres[k].restFrame));
    EXPECT_TRUE(sameBits(a.spheres[k].restLinkEnd, b.spheres[k].restLinkEnd));
    EXPECT_TRUE(sameBits(a.spheres[k].volume, b.spheres[k].volume));
    EXPECT_TRUE(sameBits(a.spheres[k].secondMoment, b.spheres[k].secondMoment));
  }
  ASSERT_EQ(b.links.size(), 1u);
  const ElasticLink &l = a.links[0], &m = b.links[0];
  EXPECT_EQ(l.sphere0, m.sphere0);
  EXPECT_EQ(l.sphere1, m.sphere1);
  for (int k = 0; k < ElasticLink::kSections; ++k) {
    const LinkSection &s = l.sections[k], &t = m.sections[k];
    EXPECT_TRUE(sameBits(s.area, t.area) && sameBits(s.torsionConstant, t.torsionConstant));
    EXPECT_TRUE(sameBits(s.bendingMomentU, t.bendingMomentU) && sameBits(s.bendingMomentV, t.bendingMomentV));
  }
  EXPECT_TRUE(sameBits(l.restU, m.restU));
  ASSERT_EQ(a.attachments.size(), b.attachments.size());
  for (std::size_t k = 0; k < a.attachments.size(); ++k) {
    EXPECT_EQ(a.attachments[k].onLink, b.attachments[k].onLink);
    EXPECT_EQ(a.attachments[k].host, b.attachments[k].host);
    EXPECT_TRUE(sameBits(a.attachments[k].along, b.attachments[k].along));
    EXPECT_TRUE(sameBits(a.attachments[k].restOffset, b.attachments[k].restOffset));
    EXPECT_TRUE(sameBits(a.attachments[k].area, b.attachments[k].area));
    EXPECT_TRUE(sameBits(a.attachments[k].volume, b.attachments[k].volume));
    EXPECT_EQ(a.attachments[k].massSphere, b.attachments[k].massSphere);
  }
}

TEST_F(ModelFile, ReadingGivesTheSameBitsOfWhatIsDrawn) {
  const SoftBodyModel a = smallModel(), b = read(textOf(a));
  EXPECT_EQ(a.buckets, b.buckets);
  EXPECT_TRUE(sameBits(a.skeleton.nodes, b.skeleton.nodes));
  EXPECT_EQ(a.skeleton.links, b.skeleton.links);
  const RenderSurface &s = a.renderSurface, &t = b.renderSurface;
  EXPECT_EQ(s.first, t.first);
  EXPECT_EQ(s.node, t.node);
  EXPECT_TRUE(sameBits(s.weight, t.weight));
  EXPECT_TRUE(sameBits(s.tangent0, t.tangent0));
  EXPECT_TRUE(sameBits(s.tangent1, t.tangent1));
  EXPECT_TRUE(sameBits(s.offset, t.offset));
  EXPECT_TRUE(sameBits(s.restPosition, t.restPosition));
  EXPECT_EQ(s.triangles, t.triangles);
}

TEST_F(ModelFile, WritingWhatWasReadGivesTheSameBytes) {
  const std::string text = textOf(smallModel());
  EXPECT_EQ(textOf(read(text)), text);
}

// Closed as it may be, finer checks and every measure rely on what a surface encloses.
TEST_F(ModelFile, SurfacesThatEncloseNothingAreRefused) {
  const auto refusalOf = [&](const SoftBodyModel& model) { return complaintOf([&] { read(textOf(model)); }); };
  SoftBodyModel turned = smallModel(), flat = turned, far = turned;
  for (auto& t : turned.triangles) std::swap(t[0], t[1]);
  for (Eigen::Vector3d& node : flat.restNodes) node.z() = 0;
  far.restNodes[0].x() = 2e6;
  EXPECT_NE(refusalOf(turned).find("<triangles>: the surface is flat or inside out"), std::string::npos);
  EXPECT_NE(refusalOf(flat).find("<triangles>: the surface is flat or inside out"), std::string::npos);
  EXPECT_NE(refusalOf(far).find("<nodes>: a place beyond 1e6 m"), std::string::npos);
}

TEST_F(ModelFile, MistakesNameTheLineAndWhatIsWrong) {
  const std::string text = textOf(smallModel());
  const struct {
    std::string from, to, complaint;
  } mistakes[] = {
      {"version=\"4\"", "version=\"1\"",
       R"(m.xml:2: <model> version="1": expected 4; make the model anew with medulla build)"},
      {"fedcba9876543210", "fedc", R"(m.xml:2: <model> mesh_hash="fedc": expected 16 hexadecimal digits)"},
      {"<edges", "<egdes", "m.xml:23: broken XML: an element is not closed where it was opened"},
      {" name=\"a", " nam=\"a", R"(m.xml:2: <model> has no attribute "nam"; did you mean "name"?)"},
      {"<nodes rows=\"4\"", "<nodes rows=\"5\"", "m.xml:15: <nodes>: fewer numbers than its rows hold"},
      {"<nodes rows=\"4\"", "<nodes rows=\"3\"", "m.xml:15: <nodes>: more numbers than its rows hold"},
      {"<nodes rows=\"4\"", "<nodes rows=\"2000000000\"", "m.xml:15: <nodes>: fewer numbers than its rows hold"},
      {"0.30000000000000004", "nan", "m.xml:13: <nodes>: expected a finite number"},
      {"0.30000000000000004", "1e999", "m.xml:13: <nodes>: expected a finite number"},
      {"0.30000000000000004", "0.3m", "m.xml:13: <nodes>: expected a finite number"},
      {"0 2 1\n", "0 2 4\n", "m.xml:18: <triangles>: an index out of range"},
      {"0 2 1\n", "0 2 -1\n", "m.xml:18: <triangles>: an index out of range"},
      {"0 2 1\n", "0 2 2\n", "m.xml:18: <triangles>: the same index twice"},
      {"0 2 1\n", "0 2 1.5\n", "m.xml:18: <triangles>: expected an integer"},
      {"0 2 1\n", "0 1 2\n", "m.xml:21: <triangles>: the surface is not closed and wound one way"},
      {"0 1\n0 2\n", "0 2\n0 1\n", "m.xml:29: <edges>: not the edges of the triangles, lower node first, sorted"},
      {"0.1 0.1 0.1 0.05", "0.1 0.1 0.1 0", "m.xml:32: <spheres>: a radius that is not positive"},
      {" 2e-05 ", " -2e-05 ", "m.xml:33: <spheres>: a volume that is not positive"},
      {"e-12 0 0 0 2e-11", "e-12 0 0 1 2e-11", "m.xml:32: <spheres>: a second moment that is not symmetric"},
      {"e-12 0 0 0 2e-11", "e-12 0 0 0 -2e-11", "m.xml:32: <spheres>: a second moment that is not positive definite"},
      {"0 1 1e-04", "0 2 1e-04", "m.xml:36: <links>: an index out of range"},
      {"0 1 1e-04", "1 1 1e-04", "m.xml:36: <links>: a link without length"},
      {"0 1 1e-04", "0 1 0", "m.xml:36: <links>: an area that is not positive"},
      {" 1e-09 ", " 0 ", "m.xml:36: <links>: a bending moment that is not positive"},
      {" 3e-09 0.7", " 3e-09 0.8", "m.xml:36: <links>: a restU that is not a unit vector"},
      {" 3e-09 0.7071067811865476 0.7071067811865476 0", " 3e-09 0 0 1",
       "m.xml:36: <links>: a restU that is not perpendicular to its link"},
      {"1 0 0.25", "1 1 0.25", "m.xml:40: <attachments>: an index out of range"},
      {"1 0 0.25", "0 0 0.25", "m.xml:40: <attachments>: a position along its host outside 0 to 1 (sphere: 0)"},
      {"1 0 0.25", "1 0 1.25", "m.xml:40: <attachments>: a position along its host outside 0 to 1 (sphere: 0)"},
      {"2 0 3\n", "2 0 1\n", "m.xml:46: <buckets>: a triangle in two buckets"},
      {"2 0 3\n", "1 0\n", "m.xml:46: <buckets>: a triangle in no bucket"},
      {"2 0 3\n", "2 0 4\n", "m.xml:45: <buckets>: an index out of range"},
  };
  for (const auto& m : mistakes) {
    std::string wrong = text;
    const std::size_t at = wrong.find(m.from);
    if (at == std::string::npos) {
      ADD_FAILURE() << m.from;
      continue;
    }
    EXPECT_EQ(complaint(wrong.replace(at, m.from.size(), m.to)), m.complaint) << m.from << " -> " << m.to;
  }
}

TEST_F(ModelFile, ArraysThatDoNotFitEachOther) {
  SoftBodyModel m = smallModel();
  m.attachments.pop_back();
  EXPECT_EQ(complaint(textOf(m)), "m.xml:41: <attachments>: expected one attachment per node");
  m = smallModel();
  m.buckets = {{0, 1, 2, 3}};
  EXPECT_EQ(complaint(textOf(m)), "m.xml:45: <buckets>: expected one bucket per sphere");
  m = smallModel();
  m.renderSurface.first = {0, 2, 3, 4};
  EXPECT_NE(complaint(textOf(m)).find("stencil sizes that do not add up"), std::string::npos);
  m = smallModel();
  m.renderSurface.node = {1, 0, 2, 0, 3};
  EXPECT_NE(complaint(textOf(m)).find("nodes of a stencil that are not ascending"), std::string::npos);
}

// What medulla build --identify adds: a link between the two spheres and one to a patch.
SoftBodyModel identifiedModel() {
  SoftBodyModel m = smallModel();
  auto network = std::make_shared<IdentifiedNetwork>();
  network->poisson = 0.3 + 0.1;
  network->lengthScale = 1. / 3;
  network->voxel = 0.01;
  for (const FillingSphere& s : m.spheres) network->frames.push_back({s.restFrame, s.volume, s.secondMoment});
  network->patches = {{"box=0,0,0,1,1,\"<1", {0, 3}}};
  network->heldFrames = {1};
  IdentifiedLink link;
  link.frame1 = 1;
  link.restPoint0 = m.spheres[0].restFrame;
  link.restPoint1 = m.spheres[1].restFrame;
  link.axes << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  link.stiffness.diagonal() << 1. / 3, 0.1, 0.2, 0.3, 1e-300, 0;
  link.stiffness(1, 0) = link.stiffness(0, 1) = 0.1 / 7;
  network->links = {link, link};
  network->links[1].frame1 = 2;
  network->links[1].restPoint1 = m.restNodes[3];
  network->links[0].strain0 << 0.7, 1. / 3, 0, 0, 0, -1e-300;
  network->links[0].strain1.setConstant(1. / 9);
  network->links[1].strain0.setConstant(-0.6);
  for (std::size_t n = 0; n < m.restNodes.size(); ++n) {
    SkinFrame own{1, 0.75, m.spheres[1].restFrame}, held{2, 0.25, m.restNodes[n]};
    own.map.setConstant(1. / 7);
    held.map.leftCols<3>().setIdentity();
    network->skin.push_back({own, held});
  }
  network->layer = {100. / 3, 20, 1e-4};
  network->bulk = {2.5, 0.1};
  network->poke = {3. / 7, 0};
  network->ofFiniteElements = {1, 0.5};
  m.identified = network;
  return m;
}

TEST_F(ModelFile, WhatWasIdentifiedIsReadToTheBit) {
  const SoftBodyModel model = identifiedModel();
  const std::string text = textOf(model);
  const SoftBodyModel again = read(text);
  EXPECT_EQ(textOf(again), text);
  ASSERT_TRUE(again.identified);
  const IdentifiedNetwork &a = *model.identified, &b = *again.identified;
  EXPECT_EQ(a.poisson, b.poisson);
  EXPECT_EQ(a.lengthScale, b.lengthScale);
  EXPECT_EQ(a.patches[0].region, b.patches[0].region);
  EXPECT_EQ(a.patches[0].nodes, b.patches[0].nodes);
  EXPECT_EQ(a.heldFrames, b.heldFrames);
  ASSERT_EQ(b.links.size(), 2u);
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(a.links[k].frame1, b.links[k].frame1);
    EXPECT_TRUE(sameBits(a.links[k].restPoint0, b.links[k].restPoint0));
    EXPECT_TRUE(sameBits(a.links[k].restPoint1, b.links[k].restPoint1));
    EXPECT_TRUE(sameBits(a.links[k].axes, b.links[k].axes));
    EXPECT_TRUE(sameBits(a.links[k].stiffness, b.links[k].stiffness));
    EXPECT_TRUE(sameBits(a.links[k].strain0, b.links[k].strain0));
    EXPECT_TRUE(sameBits(a.links[k].strain1, b.links[k].strain1));
  }
  ASSERT_EQ(b.skin.size(), 4u);
  for (std::size_t n = 0; n < 4; ++n) {
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(a.skin[n][k].frame, b.skin[n][k].frame);
      EXPECT_TRUE(sameBits(a.skin[n][k].weight, b.skin[n][k].weight));
      EXPECT_TRUE(sameBits(a.skin[n][k].restPoint, b.skin[n][k].restPoint));
      EXPECT_TRUE(sameBits(a.skin[n][k].map, b.skin[n][k].map));
    }
  }
  EXPECT_EQ(a.layer.normal, b.layer.normal);
  EXPECT_EQ(a.bulk.maximum, b.bulk.maximum);
  EXPECT_FALSE(b.usesFormulas);
}

TEST_F(ModelFile, NetworksWithoutStrainsHaveNoneInTheirFile) {
  const SoftBodyModel model = identifiedModel();
  auto plain = std::make_shared<IdentifiedNetwork>(*model.identified);
  for (IdentifiedLink& link : plain->links) link.strain0 = link.strain1 = Vector6d::Zero();
  SoftBodyModel without = model;
  without.identified = plain;
  const std::string text = textOf(without);
  EXPECT_EQ(text.find("strains"), std::string::npos);
  EXPECT_TRUE(read(text).identified->links[0].strain0.isZero(0));
  EXPECT_EQ(textOf(read(text)), text);
}

TEST_F(ModelFile, MistakesInWhatWasIdentified) {
  const std::string text = textOf(identifiedModel());
  const struct {
    std::string from, to, complaint;
  } mistakes[] = {
      {" poisson=\"0.4\"", " poisson=\"0.5\"", "<identified> poisson=\"0.5\": "},
      {" formulas=\"no\"", " formulas=\"yes\"", "<identified_skin>: no skin expected where formulas are used"},
      {"layer=\"33", "layer=\"-33", "<identified> layer="},
      {"<identified_frames rows=\"2\"", "<identified_frames rows=\"1\"", "<identified_frames>: more numbers than"},
      {"<identified_held rows=\"1\">\n1\n", "<identified_held rows=\"1\">\n2\n",
       "<identified_held>: an index out of range"},
      {"0 1 0.1 0.2 0.5 0", "0 0 0.1 0.2 0.5 0", "<identified_links>: the same index twice"},
      {"0 1 0.1 0.2 0.5 0", "0 3 0.1 0.2 0.5 0", "<identified_links>: an index out of range"},
      {"0 1 0.1 0.2 0.5 0", "0 1 0.1 0.2 0.6 0", "<identified_links>: a second end that is not its frame's"},
      {"0 1 0.1 0.2 0.5 0", "0 1 0.1 0.2 0.5 0.1", "<identified_links>: axes that are not unit"},
      {"0.3333333333333333 0.01", "-0.3333333333333333 0.01", "<identified_links>: a stiffness that is not positive"},
      {"<identified_strains rows=\"2\"", "<identified_strains rows=\"1\"", "<identified_strains>: more numbers than"},
      {"<identified_strains rows=\"2\"", "<identified_strains rows=\"3\"",
       "<identified_strains>: expected one row per"},
      {"0.7 0.3333333333333333", "nan 0.3333333333333333", "<identified_strains>: "},
      {"0.7 0.3333333333333333", "0.3333333333333333", "<identified_strains>: fewer numbers"},
      {"</identified_strains>", "</identified_strains><identified_strains rows=\"0\"></identified_strains>",
       "<identified_strains>"},
      {"2 1 0.75", "2 1 0.8", "<identified_skin>: weights whose sum is not 1"},
      {"2 1 0.75", "2 5 0.75", "<identified_skin>: an index out of range"},
      {"2 1 0.75", "9 1 0.75", "<identified_skin>: an index out of range"},
      {"<identified_patch rows=\"2\"", "<identified_patch rows=\"3\"", "<identified_patch>: fewer numbers"},
  };
  for (const auto& m : mistakes) {
    std::string wrong = text;
    const std::size_t at = wrong.find(m.from, wrong.find("<identified"));
    if (at == std::string::npos) {
      ADD_FAILURE() << m.from;
      continue;
    }
    const std::string said = complaint(wrong.replace(at, m.from.size(), m.to));
    EXPECT_NE(said.find(m.complaint), std::string::npos) << m.from << " -> " << m.to << ": " << said;
  }
}

TEST_F(ModelFile, AMissingFileIsNamed) {
  EXPECT_EQ(complaintOf([&] { readModel(temporary / "none.model.xml"); }),
            temporary / "none.model.xml: cannot be opened: No such file or directory");
}

TEST_F(ModelFile, AModelThatCannotBeWrittenHarmsNothing) {
  temporary.write("target", "earlier");
  EXPECT_THROW(writeModel(temporary / "target/m.xml", smallModel()), std::runtime_error);
  EXPECT_EQ(readTextFile(temporary / "target"), "earlier");
  EXPECT_EQ(temporary.contents().size(), 1u);
}

}  // namespace
}  // namespace medulla
