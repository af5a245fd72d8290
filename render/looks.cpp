#include "render/looks.h"

#include <stdexcept>

#include "render/renderer.h"

namespace medulla {
namespace {

using glm::vec3;

Look liver() {
  Look l;
  l.name = "liver";
  // Darker than it seems: a lighter red turns to orange plastic under the endoscope's light.
  l.albedoLow = {0.125f, 0.022f, 0.015f};
  l.albedoHigh = {0.235f, 0.047f, 0.029f};
  l.mottleFrequency = 22;
  l.wrap = {0.24f, 0.07f, 0.05f};
  l.glow = {0.46f, 0.055f, 0.024f};
  l.glowDepth = 0.008f;
  l.blood = 0.75f;
  l.bloodless = {0.44f, 0.168f, 0.135f};
  l.roughness = 0.40f;
  l.wetRoughness = 0.13f;
  l.mottle = 0.95f;
  l.vessels = 0.10f;
  l.vesselTint = {1.3f, 0.6f, 0.6f};
  l.bump = 0.33f;  // more and the highlight crinkles like foil
  l.specular = 0.85f;
  l.detailScale = 11;
  l.detail = {1024, 3, 1.2f, 0.4f, 74, 0.10f, 0};
  return l;
}

Look gallbladder() {
  Look l;
  l.name = "gallbladder";
  l.albedoLow = {0.034f, 0.062f, 0.036f};
  l.albedoHigh = {0.205f, 0.215f, 0.105f};
  l.mottleFrequency = 34;
  l.patches[0] = {{0.34f, 0.185f, 0.120f}, 60, 21, 1, {}, 0.44f, 0.68f, 0.52f};               // blood shining through
  l.patches[1] = {{0.33f, 0.130f, 0.085f}, 66, 9, 0.25f, {0, 1.1f, 0}, 0.62f, 1.15f, 0.85f};  // red neck
  l.patches[2] = {{0.62f, 0.40f, 0.13f}, 75, 40, 1, {0, 0.42f, 0}, 0.76f, 0.92f, 0.70f};      // fat
  l.wrap = {0.34f, 0.22f, 0.12f};
  l.glow = {0.16f, 0.155f, 0.045f};
  l.glowDepth = 0.006f;
  l.blood = 0.6f;
  l.bloodless = {0.30f, 0.34f, 0.17f};
  l.roughness = 0.37f;
  l.wetRoughness = 0.14f;
  l.mottle = 1.0f;
  l.vessels = 0.85f;
  l.vesselTint = {1.25f, 0.26f, 0.30f};
  l.bump = 0.42f;
  l.detailScale = 17;
  l.detail = {512, 11, 2.2f, -1.3f, 0, 0, 0};
  return l;
}

Look stomach() {
  Look l;
  l.name = "stomach";
  l.albedoLow = {0.50f, 0.155f, 0.12f};
  l.albedoHigh = {0.68f, 0.29f, 0.215f};
  l.mottleFrequency = 22;
  l.patches[0] = {{0.86f, 0.56f, 0.22f}, 22, 3, 1, {}, 0.60f, 0.74f, 0.5f};
  l.wrap = {0.45f, 0.20f, 0.14f};
  l.glow = {0.42f, 0.11f, 0.065f};
  l.glowDepth = 0.005f;
  l.blood = 0.55f;
  l.bloodless = {0.86f, 0.48f, 0.39f};
  l.roughness = 0.42f;
  l.wetRoughness = 0.14f;
  l.mottle = 0.55f;
  l.vessels = 0.62f;
  l.vesselTint = {0.78f, 0.16f, 0.25f};
  l.bump = 0.50f;
  l.detailScale = 8.4f;
  l.detail = {1024, 10, 2.6f, -0.6f, 0, 0, 0};
  return l;
}

// The small intestine: moist, with many fine vessels that reach over it from its mesentery.
Look gut() {
  Look l = stomach();
  l.name = "gut";
  l.albedoLow = {0.46f, 0.150f, 0.118f};
  l.albedoHigh = {0.66f, 0.30f, 0.235f};
  l.mottleFrequency = 30;
  l.patches[0] = {{0.60f, 0.14f, 0.12f}, 34, 5, 1, {}, 0.52f, 0.72f, 0.45f};
  l.glow = {0.52f, 0.14f, 0.085f};
  l.glowDepth = 0.005f;
  l.vessels = 0.85f;
  l.vesselTint = {0.68f, 0.12f, 0.18f};
  l.bump = 0.42f;
  l.specular = 1.1f;
  l.detailScale = 11;
  l.detail = {1024, 12, 2.0f, 1.2f, 0, 0, 0};
  return l;
}

// The large intestine: paler and greyer, less wet, with lobules of fat.
Look colon() {
  Look l = gut();
  l.name = "colon";
  l.albedoLow = {0.34f, 0.150f, 0.110f};
  l.albedoHigh = {0.51f, 0.262f, 0.192f};
  l.patches[0] = {{0.64f, 0.33f, 0.105f}, 38, 8, 1, {}, 0.54f, 0.72f, 0.7f};
  l.glow = {0.42f, 0.17f, 0.10f};
  l.glowDepth = 0.005f;
  l.vessels = 0.75f;
  l.bump = 0.38f;
  l.specular = 0.8f;
  l.detailScale = 10;
  l.detail.vesselHeading = 0.3f;
  return l;
}

Look fat() {
  Look l;
  l.name = "fat";
  l.albedoLow = {0.60f, 0.285f, 0.060f};
  l.albedoHigh = {0.86f, 0.52f, 0.17f};
  l.mottleFrequency = 22;
  l.patches[0] = {{0.50f, 0.15f, 0.08f}, 22, 3, -1, {}, -0.47f, -0.36f, 0.55f};
  l.wrap = {0.34f, 0.26f, 0.10f};
  l.glow = {0.50f, 0.27f, 0.05f};
  l.glowDepth = 0.005f;
  l.blood = 0.7f;
  l.bloodless = {0.80f, 0.58f, 0.26f};
  l.roughness = 0.38f;
  l.wetRoughness = 0.14f;
  l.mottle = 0.75f;
  l.vessels = 0.55f;
  l.vesselTint = {0.75f, 0.16f, 0.20f};
  l.bump = 0.6f;
  l.specular = 1.3f;
  l.detailScale = 12;
  l.unrollRadius = 0.006f;
  l.unrollTilt = 0.96f;  // lies flat, seen from above its front
  l.castsShadow = false;
  l.detail = {512, 9, 2.0f, 0.9f, 19, 0.07f, 0.20f};
  return l;
}

Look wall() {
  Look l;
  l.name = "wall";
  l.albedoLow = {0.36f, 0.085f, 0.065f};
  l.albedoHigh = {0.60f, 0.22f, 0.16f};
  l.mottleFrequency = 22;
  l.patches[0] = {{0.88f, 0.58f, 0.20f}, 11, 2, 1, {}, 0.53f, 0.63f, 0.42f, 0.9f};
  l.wrap = {0.40f, 0.16f, 0.10f};
  l.roughness = 0.42f;
  l.wetRoughness = 0.19f;
  l.mottle = 0.60f;
  l.vessels = 0.60f;
  l.vesselTint = {0.75f, 0.20f, 0.25f};
  l.bump = 0.20f;
  l.specular = 0.35f;
  l.detailScale = 5.0f;
  l.castsShadow = false;
  l.encloses = true;
  l.detail = {1024, 10, 2.4f, 0.4f, 0, 0, 0};
  return l;
}

// Countershaded. Under water no film lies on the skin: what shines in air is matt there.
Look dolphin() {
  Look l;
  l.name = "dolphin";
  l.albedoLow = {0.085f, 0.100f, 0.120f};
  l.albedoHigh = {0.130f, 0.150f, 0.175f};
  l.mottleFrequency = 2;
  l.patches[0] = {{0.30f, 0.325f, 0.34f}, 4, 7, 0.12f, {0, -1, 0}, -0.46f, -0.30f, 0.9f};  // grey flanks
  l.patches[1] = {{0.56f, 0.55f, 0.54f}, 3, 5, 0.10f, {0, -1, 0}, -0.26f, -0.16f, 0.9f};   // pale belly
  // Fins and flukes are as dark as the back: they reach out farther to both sides than a body of their height (0.601).
  l.patches[2] = {{0.105f, 0.122f, 0.145f}, 0, 0, 0, {0, -0.6f, 1}, 0.605f, 0.655f, 1};
  l.patches[3] = {{0.105f, 0.122f, 0.145f}, 0, 0, 0, {0, -0.6f, -1}, -0.395f, -0.345f, 1};
  l.patches[4] = {{0.105f, 0.122f, 0.145f}, 0, 0, 0, {-1, 0, 0}, -0.20f, -0.14f, 1};  // flukes, between their tips
  l.spot = {{0.010f, 0.011f, 0.013f}, {0.863f, 0.425f}, 0.034f};                      // eyes
  l.wrap = {0.10f, 0.12f, 0.14f};
  l.roughness = 0.50f;
  l.wetRoughness = 0.30f;
  l.specular = 0.45f;
  l.mottle = 0.16f;
  l.bump = 0.06f;
  l.detailScale = 1.5f;
  l.detail = {256, 0, 0, 0, 0, 0, 0};
  return l;
}

// Sand with darker growth, to be seen from above.
Look seabed() {
  Look l;
  l.name = "seabed";
  l.albedoLow = {0.36f, 0.31f, 0.215f};
  l.albedoHigh = {0.58f, 0.51f, 0.37f};
  l.mottleFrequency = 0.6f;
  l.patches[0] = {{0.085f, 0.105f, 0.06f}, 0.22f, 12, 1, {}, 0.55f, 0.66f, 0.8f};
  l.roughness = 0.7f;
  l.wetRoughness = 0.6f;
  l.specular = 0.1f;
  l.mottle = 0.55f;
  l.bump = 0.8f;
  l.detailScale = 0.3f;
  l.unrollRadius = 1;
  l.unrollTilt = 1.5708f;
  l.castsShadow = false;
  l.encloses = true;
  l.detail = {512, 0, 0, 0, 0, 0, 0};
  return l;
}

// Matt ceramic.
Look bowl() {
  Look l;
  l.name = "bowl";
  l.albedoLow = {0.58f, 0.56f, 0.52f};
  l.albedoHigh = {0.60f, 0.58f, 0.54f};
  l.mottleFrequency = 12;
  l.roughness = 0.55f;
  l.wetRoughness = 0.40f;
  l.specular = 0.35f;
  l.mottle = 0.10f;
  l.bump = 0.04f;
  l.detail = {256, 0, 0, 0, 0, 0, 0};
  return l;
}

// Oiled wood.
Look wood() {
  Look l;
  l.name = "wood";
  l.albedoLow = {0.120f, 0.056f, 0.026f};
  l.albedoHigh = {0.215f, 0.110f, 0.054f};
  l.mottleFrequency = 5;
  l.roughness = 0.5f;
  l.wetRoughness = 0.35f;
  l.specular = 0.35f;
  l.mottle = 0.6f;
  l.bump = 0.06f;
  l.detailScale = 1.6f;
  l.unrollTilt = 1.5708f;
  l.castsShadow = false;
  l.detail = {1024, 0, 0, 0, 0, 0, 0};
  l.detail.grain = 24;
  return l;
}

// Soft toys of coloured jelly.
Look candy(const std::string& colourName, vec3 albedo) {
  Look l;
  l.name = "candy_" + colourName;
  l.albedoLow = 0.9f * albedo;
  l.albedoHigh = albedo;
  l.wrap = vec3(0.15f) + 0.2f * albedo;
  l.glow = 0.5f * albedo;
  l.glowDepth = 0.012f;
  l.roughness = 0.34f;
  l.wetRoughness = 0.20f;
  l.specular = 0.8f;
  l.mottle = 0.12f;
  l.bump = 0.05f;
  l.detail = {256, 0, 0, 0, 0, 0, 0};
  return l;
}

Look steel() {
  Look l;
  l.name = "steel";
  l.albedoLow = l.albedoHigh = {0.50f, 0.50f, 0.52f};
  l.roughness = 0.24f;
  l.wetRoughness = 0.10f;
  l.specular = 3;
  l.mottle = 0.15f;
  l.bump = 0.06f;
  l.detailScale = 40;
  l.metal = true;
  l.detail = {256, 0, 0, 0, 0, 0, 0};
  return l;
}

// Diffuse white of a calibration card: no texture, no highlight, no ambient. Its pixels follow a closed formula.
Look matte() {
  Look l;
  l.name = "matte";
  l.specular = 0;
  l.ambient = 0;
  l.detail = {16, 0, 0, 0, 0, 0, 0};
  return l;
}

}  // namespace

const std::vector<Look>& looks() {
  // A look's place seeds its texture: new ones go to the end, or the pictures of those behind them change.
  static const std::vector<Look> table = {liver(),
                                          stomach(),
                                          gallbladder(),
                                          gut(),
                                          fat(),
                                          wall(),
                                          dolphin(),
                                          steel(),
                                          matte(),
                                          colon(),
                                          seabed(),
                                          bowl(),
                                          candy("red", {0.74f, 0.045f, 0.040f}),
                                          candy("yellow", {0.88f, 0.50f, 0.035f}),
                                          candy("blue", {0.035f, 0.17f, 0.66f}),
                                          wood()};
  return table;
}

const Look& findLook(const std::string& name) {
  std::string known;
  for (const Look& look : looks()) {
    if (look.name == name) return look;
    known += (known.empty() ? "" : ", ") + look.name;
  }
  throw std::runtime_error("unknown look '" + name + "', expected one of " + known);
}

std::vector<std::string> lookNames() {
  std::vector<std::string> names;
  for (const Look& look : looks()) names.push_back(look.name);
  return names;
}

}  // namespace medulla
