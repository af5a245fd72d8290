#include "render/instrument_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/noise.h"

namespace medulla {
namespace {

using glm::vec3;

// Tool frame, m: the tip of the closed jaws at the origin, shaft along +z, jaws open about x at the hinge.
constexpr float kShaftStart = 0.0275f;
constexpr float kJawHalfWidth = 0.0021f, kJawHeight = 0.0021f;
// Height above the bite's plane: of ridges and valleys, and of the rim that the outer side ends at. The rim lies above
// the valleys, or the flank between them folds over and leaves holes.
constexpr float kRidge = 0.00008f, kValley = 0.00055f, kJawRim = 0.0006f;
constexpr int kTeeth = 13;
constexpr float kTau = 2 * std::numbers::pi_v<float>;
constexpr vec3 kSteel(0.50f, 0.50f, 0.52f), kBite = 1.2f * kSteel, kSheath(0.020f, 0.020f, 0.022f);

// How finely round things are cut. A circle of n sides strays from the round one by pi^2 / 2n^2 of its radius: for the
// same share of a pixel n grows with the root of the picture's height. Up to 720 lines it is as it was made for them:
// of 18 sides the streak of light on the shaft, which is found at vertices, was a ridge with a wedge on one side.
struct Cuts {
  int around = 32, arc = 14;  // of the shaft; of a jaw's back
  int perTooth = 1;           // along half a tooth
};
Cuts cutsFor(int pictureHeight) {
  const Cuts coarse;
  const float finer = std::sqrt(std::max(float(pictureHeight) / 720, 1.f));
  const auto times = [finer](int cuts) { return int(std::lround(finer * float(cuts))); };
  return {times(coarse.around), times(coarse.arc), times(coarse.perTooth)};
}

// Geometry in the tool frame, moved to the world as it is appended.
class Builder {
 public:
  Builder(const Instrument& instrument, SceneMesh& mesh)
      : mesh_(mesh),
        worldFromTool_(glm::mat3_cast(instrument.worldFromTool)),
        tip_(instrument.tip),
        scale_(instrument.scale) {}

  std::uint32_t vertex(vec3 p, vec3 n, vec3 albedo, float openness = 1) {
    const auto i = std::uint32_t(mesh_.position.size());
    mesh_.position.push_back(tip_ + worldFromTool_ * (scale_ * p));
    mesh_.normal.push_back(worldFromTool_ * glm::normalize(n));
    const vec3 aside = std::abs(n.z) < 0.9f * glm::length(n) ? vec3(0, 0, 1) : vec3(1, 0, 0);
    mesh_.tangent.push_back(worldFromTool_ * glm::normalize(glm::cross(aside, n)));
    mesh_.uv.push_back(40.f * glm::vec2(p.z, p.x + p.y));
    mesh_.albedo.push_back(albedo);
    mesh_.detail.push_back(1);
    mesh_.openness.push_back(openness);
    for (auto* none : {&mesh_.seam, &mesh_.thinness, &mesh_.area, &mesh_.hollow, &mesh_.blanch}) none->push_back(0);
    return i;
  }
  // Corners counter-clockwise from outside.
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    for (const std::uint32_t i : {a, b, c, a, c, d}) mesh_.index.push_back(i);
  }
  // A flat face with corners of its own.
  void face(const std::array<vec3, 4>& corner, vec3 albedo, const std::array<float, 4>& openness) {
    const auto& [a, b, c, d] = corner;
    const vec3 n = glm::cross(b - a, d - a) + glm::cross(d - c, b - c);
    if (glm::dot(n, n) < 1e-24f) return;
    std::array<std::uint32_t, 4> i;
    for (int k = 0; k < 4; ++k) i[k] = vertex(corner[k], n, albedo, openness[k]);
    quad(i[0], i[1], i[2], i[3]);
  }

 private:
  SceneMesh& mesh_;
  glm::mat3 worldFromTool_;
  vec3 tip_;
  float scale_;
};

struct Ring {
  float z, radius;
};

// Surface of revolution about z; the normals follow the profile smoothly, so that a crease needs two close rings. Its
// sides are laid out from `facing` on, rad from +x, where the eye is: turning with the tool, their vertices would pass
// the lamp's streak one by one, and it would pulse.
void lathe(Builder& b, const std::vector<Ring>& profile, vec3 albedo, float facing, int around) {
  std::uint32_t previous = 0;
  for (std::size_t k = 0; k < profile.size(); ++k) {
    const Ring &before = profile[k ? k - 1 : 0], &after = profile[k + 1 < profile.size() ? k + 1 : k];
    const float dz = after.z - before.z, dr = after.radius - before.radius;
    std::uint32_t first = 0;
    for (int s = 0; s <= around; ++s) {
      const float a = facing + kTau * float(s) / float(around), x = std::cos(a), y = std::sin(a);
      const std::uint32_t i =
          b.vertex({profile[k].radius * x, profile[k].radius * y, profile[k].z}, {dz * x, dz * y, -dr}, albedo);
      if (s == 0) first = i;
    }
    for (std::uint32_t s = 0; k > 0 && s < std::uint32_t(around); ++s)
      b.quad(previous + s, previous + s + 1, first + s + 1, first + s);
    previous = first;
  }
}

// `eye`: in the tool frame, m at scale 1. One inside the sheath would look through a black tube, of which the lens
// hides what is nearest: it ends behind the collar then.
void addShaft(Builder& b, vec3 eye, int around) {
  const float r = kShaftRadius, facing = std::atan2(eye.y, eye.x);
  const bool isInside = eye.z > kShaftStart && eye.z < kShaftEnd && std::hypot(eye.x, eye.y) < r;
  // Clevis that holds the hinge, and the collar.
  lathe(b,
        {{kHinge - 0.0012f, 0.0001f},
         {kHinge - 0.0010f, 0.0013f},
         {kHinge, 0.0019f},
         {kHinge + 0.0015f, 0.0021f},
         {kHinge + 0.0045f, 0.0022f},
         {kHinge + 0.0048f, 0.0024f},
         {kShaftStart, 0.0025f},
         {kShaftStart + 0.0004f, 0.0025f}},
        kSteel, facing, around);
  // Light is computed per vertex and interpolated without perspective: rings stay close.
  std::vector<Ring> sheath = {{kShaftStart, 0.0023f}, {kShaftStart + 0.0001f, r - 0.0001f}, {kShaftStart + 0.0004f, r}};
  constexpr float kSpacing = 0.006f;
  const float length = isInside ? kSpacing : kShaftEnd - kShaftStart;
  for (int k = 1; k <= int(length / kSpacing); ++k) sheath.push_back({kShaftStart + kSpacing * float(k), r});
  // Its end, closed, with an edge that is a little round.
  const float end = sheath.back().z;
  for (const Ring& ring : {Ring{0.0002f, r - 0.00006f}, {0.00034f, r - 0.0002f}, {0.0004f, r - 0.0004f}, {0.0004f, 0}})
    sheath.push_back({end + ring.z, ring.radius});
  lathe(b, sheath, kSheath, facing, around);
}

// Half width and height of a jaw along its length, t = 0 at the hinge, 1 at the tip.
struct JawSection {
  float z, halfWidth, height;
};
JawSection jawSection(float t) {
  const float end = t > 0.88f ? std::sqrt(std::max(1 - (t - 0.88f) * (t - 0.88f) / 0.0145f, 0.f)) : 1.f;
  // Slim at the hinge, where both jaws lie inside the clevis.
  const float root = 0.45f + 0.55f * std::min(t / 0.16f, 1.f);
  return {kHinge * (1 - t), kJawHalfWidth * root * (1 - 0.22f * t) * (0.12f + 0.88f * end),
          kJawHeight * root * (1 - 0.45f * t) * (0.25f + 0.75f * end)};
}

// side = +1: the jaw above the xz plane; the other is its mirror image, so that its faces turn the other way. p.y
// points away from the bite; turned about the hinge.
vec3 placeOnJaw(vec3 p, float side, float angle) {
  const float c = std::cos(angle), s = std::sin(angle) * side;
  const float dz = p.z - kHinge, dy = p.y * side;
  return {p.x, c * dy - s * dz, kHinge + s * dy + c * dz};
}

// The outer side.
void addJaw(Builder& b, float side, float angle, const Cuts& cuts) {
  const float c = std::cos(angle), s = std::sin(angle) * side;
  const auto place = [&](float x, float y, float z) { return placeOnJaw({x, y, z}, side, angle); };
  const auto turned = [&](vec3 n) { return vec3(n.x, c * n.y * side - s * n.z, s * n.y * side + c * n.z); };
  const int slices = 2 * kTeeth * cuts.perTooth;
  std::uint32_t previous = 0;
  for (int k = 0; k <= slices; ++k) {
    const float t = float(k) / float(slices);
    const JawSection j = jawSection(t);
    std::uint32_t first = 0;
    for (int a = 0; a <= cuts.arc; ++a) {  // outer side: a flattened half ellipse from +x over the back to -x
      const float phi = 0.5f * kTau * float(a) / float(cuts.arc), x = std::cos(phi),
                  y = std::pow(std::sin(phi) + 1e-6f, 0.8f);
      const float lean = t > 0.85f ? -0.9f * (t - 0.85f) / 0.15f : -0.05f;
      const std::uint32_t i =
          b.vertex(place(j.halfWidth * x, kJawRim + std::max(j.height - kJawRim / 2, 0.0001f) * y, j.z),
                   turned({x / j.halfWidth, std::sin(phi) / j.height, lean / j.height}), kSteel);
      if (a == 0) first = i;
    }
    for (std::uint32_t a = 0; k > 0 && a < std::uint32_t(cuts.arc); ++a)
      if (side > 0)
        b.quad(previous + a, first + a, first + a + 1, previous + a + 1);
      else
        b.quad(previous + a, previous + a + 1, first + a + 1, first + a);
    previous = first;
  }
}

// The inner side: transverse ridges, flat faces; smooth near the hinge and at the very tip. teeth: 0..1, how far they
// stand out.
void addBite(Builder& b, float side, float angle, float teeth, int perTooth) {
  const float valleys = glm::mix(kRidge, kValley, teeth);
  const auto place = [&](float x, float y, float z) { return placeOnJaw({x, y, z}, side, angle); };
  const auto profile = [valleys, teeth](int halfTooth) {
    const float t = float(halfTooth) / (2 * kTeeth);
    const float y = halfTooth % 2 == 0 && t > 0.2f && t < 0.97f ? valleys : kRidge;
    const float deep = std::min(0.05f + 6 * t * t, 0.4f + 0.6f * t);  // in the clevis a flat face mirrors the lamp
    return glm::vec2(y, (y < valleys ? 0.9f : glm::mix(0.9f, 0.3f, teeth)) * deep);
  };
  // Height above the bite's plane and openness, straight from ridge to valley.
  const auto cut = [&](int k) {
    return glm::mix(profile(k / perTooth), profile(k / perTooth + 1), float(k % perTooth) / float(perTooth));
  };
  const int cuts = 2 * kTeeth * perTooth;
  for (int k = 0; k < cuts; ++k) {
    const float t0 = float(k) / float(cuts), t1 = float(k + 1) / float(cuts);
    const JawSection j0 = jawSection(t0), j1 = jawSection(t1);
    const glm::vec2 c0 = cut(k), c1 = cut(k + 1);
    const vec3 p0 = place(-j0.halfWidth, c0.x, j0.z), p1 = place(j0.halfWidth, c0.x, j0.z),
               q0 = place(-j1.halfWidth, c1.x, j1.z), q1 = place(j1.halfWidth, c1.x, j1.z);
    const std::array<float, 2> open{c0.y, c1.y};
    if (side > 0)
      b.face({p0, q0, q1, p1}, kBite, {open[0], open[1], open[1], open[0]});
    else
      b.face({p0, p1, q1, q0}, kBite, {open[0], open[0], open[1], open[1]});
    // Flank between the outer side's rim and the ridge, dark in the clevis, too.
    const auto rimAt = [](float t) { return std::min(0.85f, 0.05f + 20 * t * t); };
    const float rim0 = rimAt(t0), rim1 = rimAt(t1);
    for (const float x : {-1.f, 1.f}) {
      const vec3 a = place(x * j0.halfWidth, kJawRim, j0.z), d = place(x * j1.halfWidth, kJawRim, j1.z);
      const vec3 e = x < 0 ? p0 : p1, f = x < 0 ? q0 : q1;
      if ((side > 0) == (x > 0))
        b.face({a, e, f, d}, kSteel, {rim0, open[0], open[1], rim1});
      else
        b.face({a, d, f, e}, kSteel, {rim0, rim1, open[1], open[0]});
    }
  }
}

}  // namespace

void appendInstrument(const Instrument& instrument, const Viewpoint& view, int pictureHeight, SceneMesh& mesh) {
  MeshPart part;
  part.look = &findLook("steel");
  part.instrument = true;
  part.firstVertex = std::uint32_t(mesh.position.size());
  part.firstIndex = std::uint32_t(mesh.index.size());
  Builder builder(instrument, mesh);
  const Cuts cuts = cutsFor(pictureHeight);
  for (const float side : {1.f, -1.f}) addJaw(builder, side, instrument.jawAngle, cuts);
  const vec3 toEye = glm::inverse(instrument.worldFromTool) * (view.position - instrument.tip);
  addShaft(builder, toEye / instrument.scale, cuts.around);
  // Teeth of a few pixels would be specks that flicker.
  const float metresPerPixel = 2 * std::max(glm::length(toEye), 1e-3f) * view.tangent / float(pictureHeight);
  const float teeth = smoothStep(4, 9, instrument.scale * kHinge / kTeeth / metresPerPixel);
  for (const float side : {1.f, -1.f}) addBite(builder, side, instrument.jawAngle, teeth, cuts.perTooth);
  part.vertexCount = std::uint32_t(mesh.position.size()) - part.firstVertex;
  part.indexCount = std::uint32_t(mesh.index.size()) - part.firstIndex;
  mesh.parts.push_back(part);
}

void removeInstruments(SceneMesh& mesh) {
  while (!mesh.parts.empty() && mesh.parts.back().instrument) {
    mesh.index.resize(mesh.parts.back().firstIndex);
    mesh.resizeVertices(mesh.parts.back().firstVertex);
    mesh.parts.pop_back();
  }
}

}  // namespace medulla
