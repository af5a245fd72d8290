#include "render/vertex_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "render/noise.h"

namespace medulla {
namespace {

using glm::vec3;

// Light scattered by the cavity itself, where no haze is given; linear RGB: from below and from above, at grazing
// surfaces, and the veil of moist air.
constexpr vec3 kAmbientBelow(0.110f, 0.060f, 0.050f), kAmbientAbove(0.190f, 0.125f, 0.110f);
constexpr vec3 kRimLight(0.10f, 0.045f, 0.035f), kVeil(0.085f, 0.022f, 0.016f);

// Reflectance at normal incidence of a film of water, a little raised (Schlick 1994).
constexpr float kFilmReflectance = 0.035f;

constexpr float kHorizon = -0.05f;  // cosine to the light from which on all is dark

// Everything about one picture that the vertices share.
struct Surroundings {
  const Viewpoint& view;
  const Light& light;
  const LightView& lightView;
  const HazeField* haze;
  float time;
  bool studio;                 // before the model's light backdrop instead of in the cavity
  float coneInner, coneOuter;  // cosines: the endoscope's cone is a little wider than the picture
  vec3 below = kAmbientBelow, above = kAmbientAbove, rim = kRimLight;
  vec3 lamp{1};  // colour of its light
};

// One vertex while it is lit.
struct Shading {
  vec3 normal, toEye, toLight;
  float eyeDistance, lightDistance;
  float exposure;   // light per albedo without distance: falls off towards the rim, and in the veil
  float veil;       // 0..1
  float veilLight;  // of the veil, as exposure is of albedo
  vec3 veilColour;
  float distanceFalloff;  // of the light
  float falloff;          // with its cone and ripples
  vec3 albedo;
  float openness, thinness;
};

// A surface facing the light at distance d gets, per unit of albedo,
//   kExposure * intensity * 1.14 r^2 / (d^2 + 0.14 r^2),  r = referenceDistance:
// inverse square, softened because the light has a size and a camera's automatic exposure holds back near glare.
constexpr float kExposure = 1.3f, kSoftening = 0.14f;
float lightFalloff(const Light& light, float distance) {
  const float r2 = light.referenceDistance * light.referenceDistance;
  return light.intensity * (1 + kSoftening) * r2 / (distance * distance + kSoftening * r2);
}

Shading shadingOf(const SceneMesh& mesh, const Look& look, std::size_t i, vec3 picture, const Surroundings& s) {
  Shading v;
  v.normal = mesh.normal[i];
  v.toEye = s.view.position - mesh.position[i];
  v.eyeDistance = std::max(glm::length(v.toEye), 1e-6f);
  v.toEye /= v.eyeDistance;
  v.toLight = s.lightView.position - mesh.position[i];
  v.lightDistance = std::max(glm::length(v.toLight), 1e-6f);
  v.toLight /= v.lightDistance;
  v.falloff = v.distanceFalloff = lightFalloff(s.light, v.lightDistance);
  if (!s.light.position)
    v.falloff *= smoothStep(s.coneOuter, s.coneInner, -glm::dot(v.toLight, s.lightView.direction));
  else if (s.light.caustics > 0 && !look.encloses)  // backdrops are too coarse for ripples
    v.falloff *= causticAt(mesh.position[i], v.toLight, s.light.caustics, s.time);
  const float vignette = vignetteAt(s.view, glm::vec2(picture));
  v.exposure = kExposure * vignette;
  const float reference = s.light.referenceDistance;
  v.veil = s.haze         ? s.haze->veil(v.eyeDistance)
           : s.view.round ? 1 - std::exp(-0.65f * std::max(v.eyeDistance / reference - 0.76f, 0.f))
                          : 0.f;
  v.veilLight = s.haze ? vignette : v.exposure;
  v.veilColour = s.haze ? s.haze->toward(-v.toEye) : kVeil;
  const float blanch = mesh.blanch[i];
  const vec3 dammed(0.86f, 0.62f, 0.62f);  // factor on the albedo of tissue full of blood
  v.albedo = blanch > 0 ? glm::mix(mesh.albedo[i], look.bloodless, look.blood * blanch)
                        : mesh.albedo[i] * glm::mix(vec3(1), dammed, -blanch * look.blood);
  v.openness = mesh.openness[i];
  v.thinness = mesh.thinness[i];
  return v;
}

float grazingOf(const Shading& v) {
  return 1 - std::max(glm::dot(v.normal, v.toEye), 0.f);
}

float fresnelEdge(const Shading& v) {
  const float grazing = grazingOf(v);
  return grazing * grazing * grazing * grazing;
}

void lightTissue(const Shading& v, const Look& look, const Surroundings& s, LitVertex& out) {
  const float cosine = glm::dot(v.normal, v.toLight), visible = v.exposure * (1 - v.veil);
  const vec3 reach = 1.f + look.wrap;
  const vec3 diffuse = glm::max((cosine + look.wrap) / (reach * reach), 0.f);
  const float crease = look.ambient > 0 ? 0.55f + 0.45f * v.openness : 1.f;
  out.direct = v.albedo * diffuse * s.lamp * (v.falloff * visible * crease);
  // In the cavity it comes from where the lamp shines, from around the lens: what lies in shadow keeps its form.
  const float fromLens = s.light.position ? 1.f : 0.55f + 0.75f * std::max(glm::dot(v.normal, v.toEye), 0.f);
  const vec3 sky = glm::mix(s.below, s.above, v.normal.y * 0.5f + 0.5f) * (v.openness * fromLens);
  // Light that came in elsewhere and leaves where the tissue is thin, most of it sideways.
  if (v.thinness > 0)
    out.direct += look.glow * s.lamp * (v.thinness * (0.35f + 0.65f * grazingOf(v)) * v.falloff * visible);
  // Behind the horizon the shaders know shadow alone: what wraps and glows fades towards it, or triangles that lie
  // across would show as teeth. Of a lamp beside the lens the horizon is the outline, a black line where all is lost:
  // half comes through the tissue, shadow or not. What a lamp in the world leaves dark is wide, and would glow in
  // bands.
  const float through = s.light.position ? 0.f : 0.5f;
  const vec3 lost = out.direct * (1 - smoothStep(kHorizon, s.light.position ? 0.25f : 0.12f, cosine));
  out.direct -= lost;
  const vec3 rim = s.rim * (fresnelEdge(v) * v.openness * 0.8f * std::min(v.falloff, 1.5f));
  out.ambient = (v.albedo * sky * 1.2f + rim) * (visible * look.ambient) + through * lost;
}

// Polished metal and the sheath's lacquer mirror the cavity: dim red below, pale tissue above, black where the port and
// the gaps between organs are, and the lamp's wide reflector, seen beside the lens. What is mirrored lies in the lamp's
// cone even where the shaft itself leaves it. In haze it mirrors that, and half as much of dark things in it; beside
// the model the grey of a studio, before whose light ground jaws that shine white are lost.
void lightMetal(const Shading& v, std::optional<vec3> tangent, const Surroundings& s, LitVertex& out) {
  const float visible = v.exposure * (1 - v.veil), facing = glm::dot(v.normal, v.toEye);
  // The outline's vertices look away by up to an edge; as they are, they would mirror what is behind them, black.
  const vec3 bent = v.normal - facing * v.toEye;
  const vec3 normal = facing < 0 ? bent / std::max(glm::length(bent), 0.1f) : v.normal;
  const vec3 mirrored = 2.f * std::max(facing, 0.f) * normal - v.toEye;
  const float above = mirrored.y * 0.5f + 0.5f, toLamp = glm::dot(mirrored, v.toLight);
  const float lamp = 0.9f * smoothStep(0.75f, 0.99f, toLamp) + 0.22f * smoothStep(-0.2f, 0.5f, toLamp);
  const float gap = 1 - 0.75f * smoothStep(0.35f, 0.05f, std::abs(mirrored.y + 0.25f));
  const vec3 cavity = (vec3(0.045f, 0.014f, 0.011f) + vec3(0.17f, 0.085f, 0.07f) * (above * above)) * gap;
  const float lit = std::min(v.distanceFalloff, 1.4f);
  const vec3 studio = vec3(0.14f, 0.145f, 0.155f) + vec3(0.34f, 0.34f, 0.33f) * (above * above);
  const vec3 around = s.haze     ? s.haze->toward(mirrored) * (0.5f * gap / kExposure)
                      : s.studio ? studio * lit
                                 : cavity * lit;
  // Brushed or drawn along its length, it shows the lamp as a streak (Kajiya and Kay 1989). A texture's directions are
  // no brush's: where they meet, as at a ball's poles, a streak would end in rags.
  const vec3 halfway = glm::normalize(v.toLight + v.toEye);
  const vec3 along = tangent ? glm::cross(v.normal, *tangent) : vec3(0);
  const vec3 across = halfway - along * glm::dot(halfway, along);
  const float streak = smoothStep(0.955f, 1.0f, glm::dot(normal, across) / std::max(glm::length(across), 1e-3f));
  const float edge = facing < 0 ? 0.f : fresnelEdge(v);
  out.direct = v.albedo * (std::max(glm::dot(v.normal, v.toLight), 0.f) * v.falloff * 0.10f * visible);
  const vec3 mirror = v.albedo * 1.15f + 0.022f + 0.10f * edge;
  const vec3 shine = mirror * vec3(0.60f, 0.58f, 0.55f) * lamp + (0.60f * v.albedo + 0.20f) * streak;
  out.ambient = (mirror * around + (s.studio ? 0.5f : 1.f) * s.lamp * shine * lit) * (v.openness * visible);
}

// Can the highlight be seen anywhere within the slopes of the relief? (Most pixels of tissue cannot: they go to a
// cheaper shader.)
bool canGlint(float gloss, float cosine, const Look& look, const GlossLobes& lobes) {
  constexpr float kVisible = 0.008f;  // two grey levels in the dark
  const float c = std::clamp(cosine, 0.f, 1.f), s = std::sqrt(1 - c * c);
  const float slope = look.bump * 0.42f, tiltCos = 1 / std::sqrt(1 + slope * slope), tiltSin = slope * tiltCos;
  const float best = s < tiltSin && c > 0.5f ? 1.f : c * tiltCos + s * tiltSin, x = best * best;
  const float d1 = 1 + (lobes.a1 - 1) * x, d2 = 1 + (lobes.a2 - 1) * x;
  return gloss * (lobes.c1 / (d1 * d1) + std::min(lobes.c2 / (d2 * d2), kFilmPeak)) > kVisible;
}

// Is the vertex lit, dark, or near an edge? Looks around it in the shadow map as far as a soft edge reaches; the
// distance of what it finds in the way sets how soft the edge is (Fernando 2005, percentage-closer soft shadows).
Shade shadeVertex(const ShadowMap& shadow, vec3 texel, float spacing, const Shading& v, const LightView& light,
                  LitVertex& out) {
  struct Tap {
    float x, y, away;  // of 22
  };
  constexpr Tap kTaps[] = {{0, 0, 0},       {18, 0, 18},      {-18, 0, 18},     {0, 18, 18},       {0, -18, 18},
                           {13, 13, 18.4f}, {13, -13, 18.4f}, {-13, 13, 18.4f}, {-13, -13, 18.4f}, {8, 4, 8.9f},
                           {-8, -4, 8.9f},  {4, -8, 8.9f},    {-4, 8, 8.9f},    {0, 22, 22},       {0, -22, 22},
                           {22, 0, 22},     {-22, 0, 22}};
  // The surface bends away from its tangent plane within the taps' reach: where it faces the light it would shade
  // itself, and whole highlights would go to the dear shader.
  constexpr float kMinimumBias = 0.0008f, kBend = 0.12f;
  const float cosine = glm::dot(v.normal, v.toLight);
  const float slope = std::min(std::sqrt(std::max(1 - cosine * cosine, 0.f)) / std::max(cosine, 0.12f), 4.f);
  const float range = light.farDistance * light.nearDistance / (light.farDistance - light.nearDistance);
  const float depthPerMetre = range / (v.lightDistance * v.lightDistance);
  // How far to look and how wide an edge may be is told in texels of the coarsest map: in a finer one they are several.
  const float fine = shadow.fineness();
  const float metresPerTexel = 2 * v.lightDistance * light.tangent / kShadowSide;
  // As far as a soft edge reaches beyond the middle between this vertex and the next ones, m apart. Seen from near they
  // stand far apart: wider rings then look between them.
  constexpr float kSoft = 8.5f, kRing = 22, kFarthest = 5 * kRing, kWiden = 1.4f;  // texels
  const float reach = std::min(kSoft + 0.8f * spacing / metresPerTexel, kFarthest) / kRing;
  int lit = 0, tried = 0;
  float blockers = 0, blockerDepth = 0;
  const auto look = [&](float ring) {
    for (const Tap& tap : kTaps) {
      const int x = int(texel.x + fine * ring * tap.x), y = int(texel.y + fine * ring * tap.y);
      if (x < 0 || y < 0 || x >= shadow.map.width || y >= shadow.map.height) continue;
      ++tried;
      const float bias = kMinimumBias + depthPerMetre * (0.5f + ring * tap.away) * metresPerTexel * (slope + kBend);
      const float depth = shadow.map.at(x, y);
      if (texel.z - bias <= depth) {
        ++lit;
      } else {
        blockers += 1;
        blockerDepth += depth;
      }
    }
  };
  look(std::min(reach, 1.f));
  // Once an edge is found, no ring can change that.
  for (float ring = 1; ring < reach && (lit == 0 || lit == tried);) {
    ring = std::min(ring * kWiden, reach);
    look(ring);
  }
  out.shadowRadius = 2;
  if (blockers > 0) {
    const float gap = (texel.z - blockerDepth / blockers) / depthPerMetre;
    out.shadowRadius = std::min(1.2f + 0.03f * std::max(gap, 0.f) * fine / metresPerTexel, 7 * fine);
  }
  out.shadowBias = 0.0007f + 1.8f * depthPerMetre * metresPerTexel / fine * (out.shadowRadius + 0.7f) * slope;
  if (cosine < kHorizon) return Shade::dark;
  return lit == tried ? Shade::lit : lit == 0 ? Shade::dark : Shade::edge;
}

}  // namespace

GlossLobes glossLobes(const Look& look) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const auto fourth = [](float x) { return x * x * x * x; };
  const float a1 = fourth(look.roughness), a2 = fourth(look.wetRoughness);
  return {a1, a1 / kPi * 0.18f * look.specular, a2, a2 / kPi * 0.22f * look.specular};
}

namespace {

Surroundings makeSurroundings(const Viewpoint& view, const Picture& picture, const LightView& lightView,
                              const HazeField* haze) {
  const float corner = view.round ? 2 * view.rim : 1.6f * std::sqrt(1 + view.aspect * view.aspect);
  const float cone = std::atan(corner * std::max(view.tangent, kLampTangent));
  const Light& light = picture.light;
  Surroundings s{view,
                 light,
                 lightView,
                 haze,
                 picture.time,
                 picture.view == ViewKind::model,
                 std::cos(0.40f * cone),
                 std::cos(std::min(1.07f * cone, 1.5f))};
  if (!haze) return s;
  s.below = haze->below();
  s.above = haze->above();
  s.rim = 0.3f * light.haze->colour;
  // The medium filters the lamp's light on its way, too.
  const vec3 c = light.haze->colour;
  s.lamp = glm::mix(vec3(1), c / std::max({c.x, c.y, c.z, 1e-6f}), 0.35f);
  return s;
}

// i: of the mesh. Returns what is left to do for shadow: how the light falls.
Shading lightVertex(const SceneMesh& mesh, const MeshPart& part, std::size_t i, vec3 picture, const Surroundings& s,
                    LitVertex& o) {
  const Look& look = *part.look;
  o.position = mesh.position[i];
  o.uv = mesh.uv[i];
  o.detail = mesh.detail[i] * (1 - look.blood * mesh.blanch[i] * std::max(mesh.blanch[i], 0.f));
  const Shading v = shadingOf(mesh, look, i, picture, s);
  if (look.metal)
    lightMetal(v, part.instrument ? std::optional(mesh.tangent[i]) : std::nullopt, s, o);
  else
    lightTissue(v, look, s, o);
  o.ambient += v.veilColour * (v.veil * v.veilLight * look.ambient);
  if (s.haze) o.detail *= 1 - v.veil;
  o.seam = mesh.seam[i];

  const vec3 halfway = glm::normalize(v.toLight + v.toEye);
  const float lh = glm::dot(v.toLight, halfway);
  const float fresnel = kFilmReflectance + (1 - kFilmReflectance) * std::exp2((-5.55473f * lh - 6.98316f) * lh);
  // Deep in a cleft its walls stand in the lamp's way.
  const float open = std::min(2 * v.openness, 1.f);
  o.gloss =
      fresnel * std::max(glm::dot(v.normal, v.toLight), 0.f) * v.falloff * 3 * v.exposure * (1 - v.veil) * open * open;
  const vec3 t = mesh.tangent[i];
  o.halfway = {glm::dot(halfway, t), glm::dot(halfway, glm::cross(v.normal, t)), glm::dot(halfway, v.normal)};
  o.shadowRadius = 2;
  o.shadowBias = 0;
  return v;
}

}  // namespace

void lightVertices(const SceneMesh& mesh, const VisibleTriangles& seen, const Viewpoint& view, const Picture& picture,
                   const LightView& lightView, const HazeField* haze, const ShadowMap* shadow, VertexLight& out) {
  const std::size_t n = seen.vertices.size();
  out.vertices.resize(n);
  out.shade.assign(n, Shade::lit);
  out.glinting.resize(n);
  const Surroundings s = makeSurroundings(view, picture, lightView, haze);
  for (const VisiblePart& visible : seen.parts) {
    const MeshPart& part = mesh.parts[visible.part];
    const GlossLobes lobes = glossLobes(*part.look);
    for (std::size_t k = visible.firstVertex; k < visible.endVertex(); ++k) {
      const std::size_t i = seen.vertices[k];
      LitVertex& o = out.vertices[k];
      const Shading v = lightVertex(mesh, part, i, seen.picture[i], s, o);
      out.glinting[k] = canGlint(o.gloss, o.halfway.z, *part.look, lobes);
      // Instruments take no shadow: the light sits beside the lens, and a thin jaw only shadows itself in stripes.
      if (shadow && !part.instrument)
        out.shade[k] = shadeVertex(*shadow, shadow->texel[i], spacingOf(mesh, i), v, lightView, o);
    }
  }
}

}  // namespace medulla
