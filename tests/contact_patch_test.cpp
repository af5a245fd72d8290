#include "haptics/contact_patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace medulla {

static Proxy touching(int triangle) {
  Proxy proxy;
  proxy.contactCount = 1;
  proxy.contacts[0].triangle = triangle;
  proxy.contacts[0].weights = {0.5, 0.25, 0.25};
  proxy.contacts[0].normal = Eigen::Vector3d::UnitZ();
  proxy.contacts[0].share = 1;
  return proxy;
}

// So many triangles in one place.
static BlendedSurface pile(int triangles) {
  BlendedSurface surface;
  surface.triangles.assign(triangles, {0, 1, 2});
  surface.from = surface.to = {{0, 0, 0}, {0.004, 0, 0}, {0, 0.004, 0}};
  return surface;
}

// A still tool of 5 mm, on all that it has touched or `away` (m) from it; a second forgets all but 1/e of what it
// touches.
static void fade(double duration, ContactPatch& patch, const Eigen::Vector3d& away = Eigen::Vector3d::Zero()) {
  static const BlendedSurface surface = pile(2 * kContactPatchCapacity + 1);
  Proxy proxy;
  proxy.centre = pointAt(surface.triangle(0, 0), {0.5, 0.25, 0.25}) + away;
  fadePatch(surface, 0, proxy, 0.005, 0, duration, patch);
}

TEST(ContactPatch, WhatIsTouchedNowCountsHoweverManyTrianglesWereBefore) {
  ContactPatch patch;
  patch.entries.reserve(kContactPatchCapacity);
  const int last = 2 * kContactPatchCapacity;
  for (int triangle = 0; triangle <= last; ++triangle) {
    fade(0.01, patch);
    addContacts(touching(triangle).touched(), 0.005, 1, 0, patch);
  }
  ASSERT_EQ(patch.entries.size(), kContactPatchCapacity);
  for (const ContactPatch::Entry& entry : patch.entries) {
    EXPECT_GT(entry.triangle, last - kContactPatchCapacity);  // those touched last
    EXPECT_NEAR(entry.weights.sum(), entry.placed, 1e-12);
  }
  EXPECT_EQ(patch.entries.back().triangle, last);
  EXPECT_DOUBLE_EQ(patch.entries.back().share, 1);
}

TEST(ContactPatch, FadesAndIsGoneAfterAFrameWithoutTouch) {
  ContactPatch patch;
  addContacts(touching(7).touched(), 0.005, 2, 0, patch);
  fade(std::numbers::ln2, patch);
  ASSERT_EQ(patch.entries.size(), 1U);
  EXPECT_DOUBLE_EQ(patch.entries[0].share, 1);
  fade(std::numbers::ln2, patch);
  EXPECT_TRUE(patch.entries.empty());
}

TEST(ContactPatch, WhatHasComeOffTheProxyIsForgottenTwentyTimesAsFast) {
  ContactPatch patch;
  addContacts(touching(7).touched(), 0.005, 1, 0, patch);
  fade(0.01, patch, {0.002, 0, 0});
  EXPECT_NEAR(patch.entries[0].share, std::exp(-0.2), 1e-12);
}

TEST(ContactPatch, WhatLiesBelowAToolThatRidesOnARimIsNot) {
  ContactPatch patch;
  addContacts(touching(7).touched(), 0.005, 1, 0, patch);
  fade(0.01, patch, {0.001, 0, 0.002});
  EXPECT_NEAR(patch.entries[0].share, std::exp(-0.01), 1e-12);
}

// A frame as short as a tick adds little to what a second of them has.
TEST(ContactPatch, WhatBeginsGrowsToItsShareHoweverShortTheFrames) {
  ContactPatch patch;
  for (int frame = 0; frame < 1200; ++frame) {
    fade(1.0 / 60, patch);
    addContacts(touching(1).touched(), 0.005, 1, 0, patch);
    if (frame >= 600) addContacts(touching(2).touched(), 0.005, 1, 0, patch);
  }
  ASSERT_EQ(patch.entries.size(), 2U);
  EXPECT_NEAR(patch.entries[1].share / (patch.entries[0].share + patch.entries[1].share), 0.5, 0.01);
}

// Along an edge, by a tool of 5 mm.
TEST(ContactPatch, WhatTrailsBehindPushesAlongTheNormalOfItsTouch) {
  BlendedSurface surface = pile(1);
  surface.trianglesOfNodes = trianglesOfVertices({surface.from, surface.triangles});
  surface.isCrease.assign(3, 1);
  ContactPatch patch;
  Proxy proxy = touching(0);
  for (int tick = 0; tick <= 20; ++tick) {
    const double along = tick / 20.0;
    proxy.contacts[0].weights = {1 - along, along, 0};
    proxy.centre = {0.004 * along, 0, 0.005};
    addContacts(proxy.touched(), 0.005, 1, 0.0002, patch);
  }
  std::vector<ProxyContact> contacts;
  patchContacts(surface, 0, proxy, 0.005, patch, contacts);
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].point.x(), 0.0036, 0.0001);  // by a tenth of the radius behind
  EXPECT_LT((contacts[0].normal - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

}  // namespace medulla
