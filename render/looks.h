#pragma once

#include <array>
#include <glm/glm.hpp>
#include <string>
#include <vector>

// What organs look like, as data: adding a look adds its values and a row of the table to looks.cpp, and no code.
namespace medulla {

// A colour painted over parts of a surface at rest where
//   noiseWeight * fractalNoise(frequency * p + seed) + dot(gradient, q)   passes from `from` to `to`;
// p in m, q = position in the surface's bounding box, 0..1 per axis.
struct Patch {
  glm::vec3 colour{0};  // linear RGB
  float frequency = 0;  // 1/m
  float seed = 0;
  float noiseWeight = 1;
  glm::vec3 gradient{0};
  float from = 0, to = 1;
  float amount = 0;  // 0..1 at full coverage; 0 ends the list
  float warp = 0;    // cells by which the noise's places are shifted about: on a plane along its lattice it makes boxes
};

// A dot of colour on both sides of a body whose sides face +z and -z.
struct Spot {
  glm::vec3 colour{0};  // linear RGB
  glm::vec2 place{0};   // of x and y in the surface's bounding box, 0..1
  float radius = 0;     // m, to where it has faded out, from half of it on; 0: none
};

// Vessels and fine structure of the tileable detail texture.
struct DetailPattern {
  int side = 512;           // texels
  int vesselTrees = 0;      // per tile
  float vesselWidth = 2;    // texels of a 512 tile, of the widest trunk
  float vesselHeading = 0;  // rad, mean direction
  int cells = 0;            // lobules along a tile's side
  float cellContrast = 0;   // 0..1, share of the mottling they make
  float cellRelief = 0;     // 0..1, how far they bulge
  int grain = 0;            // wood: fibres and growth rings along u, so many times longer than wide; 0: neither
};

struct Look {
  std::string name;
  glm::vec3 albedoLow{0.5f}, albedoHigh{0.5f};  // linear RGB; noise at mottleFrequency mixes between them
  float mottleFrequency = 22;                   // 1/m
  std::array<Patch, 5> patches;
  Spot spot;                 // over the patches
  glm::vec3 wrap{0};         // 0..1 per channel: light that bleeds past the terminator (subsurface scattering)
  glm::vec3 glow{0};         // linear RGB: light that comes through where the tissue is thin
  float glowDepth = 0.004f;  // m of tissue that let 1/e of it through
  float blood = 0;           // 0..1: share of the colour that pressure and stretch drive out
  glm::vec3 bloodless{0.56f, 0.44f, 0.33f};  // linear RGB, without it
  float roughness = 0.4f;                    // of the tissue's own highlight
  float wetRoughness = 0.2f;                 // of the film of fluid over it
  float specular = 1;                        // factor on the highlights: 0 matt, 1 wet tissue, more: metal
  float mottle = 0;                          // contrast of the detail texture's colour
  float vessels = 0;                         // 0..1 opacity
  glm::vec3 vesselTint{1};                   // factor on the albedo where a vessel runs
  float bump = 0;                            // slope of the wet film's micro relief
  float detailScale = 10;                    // tiles per m
  float unrollRadius = 0;   // m, of the bumps the texture follows; 0: from the surface's volume and area
  float unrollTilt = 0;     // rad about x, of the axis the texture is unrolled around (0: +z)
  float ambient = 1;        // share of the cavity's light
  bool metal = false;       // mirrors the cavity instead of scattering
  bool castsShadow = true;  // what lies behind everything casts none worth its time
  bool encloses = false;    // the cavity's wall: the ambient light comes from it
  DetailPattern detail;
};

const std::vector<Look>& looks();
const Look& findLook(const std::string& name);  // throws std::runtime_error naming the known ones

}  // namespace medulla
