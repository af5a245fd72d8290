#include "render/touch.h"

#include <algorithm>
#include <cmath>

#include "render/instrument_mesh.h"

namespace medulla {

void applyStrain(const SceneMesh& rest, SceneMesh& mesh, const MeshPart& part) {
  // Full effect of stretch at this share of area gained, or lost; of a fold per slope.
  constexpr float kStretch = 1.8f, kSqueeze = 0.8f, kFold = 1.6f, kDarkest = 0.55f;
  for (std::uint32_t i = part.firstVertex; i < part.endVertex(); ++i) {
    const float gained = mesh.area[i] / std::max(rest.area[i], 1e-16f) - 1;
    mesh.blanch[i] = glm::clamp(gained / (gained > 0 ? kStretch : kSqueeze), -1.f, 0.4f);
    const float deeper = mesh.hollow[i] - rest.hollow[i];
    mesh.openness[i] *= 1 - glm::clamp(kFold * deeper, 0.f, kDarkest);
  }
}

namespace {

// x -> x + offset w, w = exp(-|narrow (x - centre)|^2), m and 1/m. A normal turns to n - grad w (offset . n) / (1 +
// offset . grad w), up to length: the inverse transpose. What lies next to the centre, over `blanched` metres, loses
// the share `pale` of its blood.
struct Bump {
  glm::vec3 centre, offset;
  glm::mat3 narrow;
  float blanched, pale;
};
void displace(const MeshPart& part, const Bump& bump, SceneMesh& mesh) {
  constexpr float kShade = 0.5f, kDarkest = 0.6f;  // share of the cavity's light lost, per slope; left at most
  for (std::size_t i = part.firstVertex; i < part.endVertex(); ++i) {
    const glm::vec3 d = mesh.position[i] - bump.centre, scaled = bump.narrow * d;
    const float q = glm::dot(scaled, scaled);
    if (q > 9) continue;
    if (bump.pale > 0)
      mesh.blanch[i] =
          glm::mix(mesh.blanch[i], 1.f, bump.pale * std::exp(-glm::dot(d, d) / (bump.blanched * bump.blanched)));
    const float w = std::exp(-q);
    const glm::vec3 gradient = (scaled * bump.narrow) * (-2 * w);
    const float along = glm::dot(bump.offset, mesh.normal[i]);
    // Where the surface would fold over itself its normal stays short of the fold.
    const float lengthened = std::max(1 + glm::dot(bump.offset, gradient), 0.2f);
    mesh.normal[i] = glm::normalize(mesh.normal[i] - gradient * (along / lengthened));
    mesh.position[i] += bump.offset * w;
    if (along < 0) mesh.openness[i] *= std::max(1 + kShade * along * glm::length(gradient), kDarkest);
  }
}

// The vertex of a moving part that is nearest to p, at most `reach` away; nullptr as part where there is none.
struct Nearest {
  const MeshPart* part = nullptr;
  glm::vec3 position{0}, normal{0};
};
Nearest nearestMoving(const SceneMesh& mesh, glm::vec3 p, float reach) {
  Nearest nearest;
  float best = reach * reach;
  for (const MeshPart& part : mesh.parts) {
    if (!part.moving) continue;
    for (std::size_t i = part.firstVertex; i < part.endVertex(); ++i) {
      const glm::vec3 d = mesh.position[i] - p;
      if (const float q = glm::dot(d, d); q < best) {
        best = q;
        nearest = {&part, mesh.position[i], mesh.normal[i]};
      }
    }
  }
  return nearest;
}

// What an instrument holds: of a smooth surface, which stays behind the held nodes that it hangs on, up to kReach, the
// nearest place.
struct Held : Nearest {
  glm::vec3 bite{0};  // m: into the jaws, as deep as they bite, comes that place
  float around = 0;   // m: what it takes along
};
constexpr float kFoldThickness = 0.0013f;  // m, at scale 1
Held heldBy(const Instrument& instrument, const SceneMesh& mesh) {
  constexpr float kWidth = 0.0055f, kReach = 0.014f, kBite = 0.0035f;  // m, at scale 1
  if (!instrument.touching || instrument.grasp <= 0) return {};
  Held held{nearestMoving(mesh, instrument.tip, instrument.scale * kReach)};
  held.bite = instrument.tip + instrument.worldFromTool * glm::vec3(0, 0, instrument.scale * kBite);
  held.around = std::max(instrument.scale * kWidth, 1.3f * glm::length(held.bite - held.position));
  return held;
}

}  // namespace

std::optional<FineSpot> spotBetweenJaws(const Instrument& instrument, const SceneMesh& mesh) {
  const Held held = heldBy(instrument, mesh);
  if (!held.part) return {};
  return FineSpot{std::size_t(held.part - mesh.parts.data()), held.position, 2 * instrument.scale * kFoldThickness};
}

// The jaws bite some of it, and between them stands a fold, as thick as they are apart there and wider than they are:
// so far beyond the tip of a tool that stands upright. Jaws that lie along the surface have it stand up beside them, as
// far as they close across it, not from above and below. It loses its blood with the grasp, not as it rises: jaws that
// open let it down before the tool lets go, and it blinked red between the one and the dent that is left.
static void riseBetweenJaws(const Instrument& instrument, float blanched, SceneMesh& mesh) {
  constexpr float kFold = 0.0090f, kRidge = 0.0062f, kFoldWidth = 0.0040f;  // m, at scale 1
  const glm::vec3 axis = instrument.worldFromTool * glm::vec3(0, 0, instrument.scale);
  const Held held = heldBy(instrument, mesh);
  if (!held.part) return;
  displace(*held.part,
           {held.position, instrument.hold * (held.bite - held.position), glm::mat3(1 / held.around), blanched,
            instrument.grasp},
           mesh);
  const glm::vec3 narrow(1 / kFoldWidth, 1 / kFoldThickness, 1 / kFoldWidth);
  glm::mat3 across = glm::mat3_cast(instrument.worldFromTool);  // a column per axis of the tool
  for (int k = 0; k < 3; ++k) across[k] *= narrow[k] / instrument.scale;
  const glm::vec3 aside = instrument.worldFromTool * glm::vec3(instrument.scale, 0, 0);
  const float upright = std::max(glm::dot(held.normal, axis) / instrument.scale, 0.f),
              flat = (1 - upright) * glm::dot(held.normal, aside) / instrument.scale;
  const glm::vec3 fold = instrument.hold * (kFold * upright * axis + kRidge * flat * aside);
  displace(*held.part, {held.bite, fold, glm::transpose(across), blanched, 0}, mesh);
}

// The simulation moves nodes a centimetre apart; this is what happens between them.
void applyTouch(const Instrument& instrument, SceneMesh& mesh) {
  constexpr float kWidth = 0.0055f, kBlanchWidth = 0.0040f, kBloodless = 0.0025f;  // the last: deep enough for it
  // A deep dent is a wide one: walls as steep as a narrow one's catch the lamp in a ring of scribbles.
  constexpr float kGentle = 2.4f;
  const float deep = glm::length(instrument.press), blanched = instrument.scale * kBlanchWidth;
  const float width = std::max(instrument.scale * kWidth, kGentle * deep);
  const float pressed = 1 - instrument.hold, pale = pressed * std::min(deep / (instrument.scale * kBloodless), 1.f);
  const Bump dent{instrument.tip - instrument.press, pressed * instrument.press, glm::mat3(1 / width), blanched, pale};
  if (pressed > 0)
    for (const MeshPart& part : mesh.parts)
      if (!part.instrument) displace(part, dent, mesh);
  riseBetweenJaws(instrument, blanched, mesh);
}

void shadeAround(const Instrument& instrument, SceneMesh& mesh) {
  const float length = kShaftEnd * instrument.scale, radius = kShaftRadius * instrument.scale,
              farthest = 0.05f * instrument.scale;  // m
  // Open jaws stand aside of the axis, and nothing shades what lies between them.
  const float open = glm::clamp((instrument.jawAngle - 0.05f) / 0.2f, 0.f, 1.f);
  const glm::vec3 axis = instrument.worldFromTool * glm::vec3(0, 0, 1),
                  start = instrument.tip + glm::mix(radius, kHinge * instrument.scale, open) * axis;
  for (const MeshPart& part : mesh.parts) {
    if (part.instrument) continue;
    for (std::size_t i = part.firstVertex; i < part.endVertex(); ++i) {
      const glm::vec3 d = mesh.position[i] - start;
      const float along = glm::clamp(glm::dot(d, axis), 0.f, length);
      const glm::vec3 away = d - along * axis;
      const float q = glm::dot(away, away);
      if (q > farthest * farthest) continue;
      const float distance = std::max(std::sqrt(q), radius);
      const float facing = std::max(-glm::dot(mesh.normal[i], away) / distance, 0.f);
      const float fade = 1 - q / (farthest * farthest);
      mesh.openness[i] *= 1 - fade * facing * radius / distance;
    }
  }
}

}  // namespace medulla
