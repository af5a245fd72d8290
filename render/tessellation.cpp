#include "render/tessellation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

namespace medulla {
namespace {

using glm::vec3;

constexpr std::uint32_t kWhole = ~0u;  // of an edge: no midpoint
constexpr float kLongest = 0.25f;      // picture heights
constexpr int kMostHalvings = 16;      // a cut through a triangle may be nearly as long as the edge that it halves

// The mesh as it grows.
struct Work {
  SceneMesh& mesh;
  std::vector<char> isSharp =
      {};  // vertices whose edges' middles stay in place: their triangles' normals lie far apart
  std::unordered_map<std::uint64_t, std::uint32_t> midpoints = {};  // of halved edges, by their ends, the smaller first
};

void appendVertices(const SceneMesh& from, const MeshPart& part, SceneMesh& to) {
  const auto first = std::ptrdiff_t(part.firstVertex), last = first + std::ptrdiff_t(part.vertexCount);
  visitVertexArrays([&](auto array) {
    (to.*array).insert((to.*array).end(), (from.*array).begin() + first, (from.*array).begin() + last);
  });
}

// From the middle of the edge to the surface: Phong tessellation (Boubekeur and Alexa 2008) with the factor 1/2. The
// normals at the ends of a chord c of a sphere of radius R have the components -c / 2R and c / 2R along it, half a
// chord times them is c^2 / 4R, and a quarter of both normals times that c^2 / 8R, the arc's height over the chord. The
// usual factor 3/4 would swell the sphere.
// None at creases: the normals of a box's corners would make a dome of each of its sides.
vec3 bulge(const Work& work, std::uint32_t a, std::uint32_t b) {
  if (work.isSharp[a] || work.isSharp[b]) return vec3(0);
  const SceneMesh& mesh = work.mesh;
  const vec3 half = 0.5f * (mesh.position[b] - mesh.position[a]);
  return 0.25f * (glm::dot(half, mesh.normal[b]) * mesh.normal[b] - glm::dot(half, mesh.normal[a]) * mesh.normal[a]);
}

std::uint32_t appendMidpoint(Work& work, std::uint32_t a, std::uint32_t b) {
  SceneMesh& mesh = work.mesh;
  const auto i = std::uint32_t(mesh.position.size());
  const vec3 offset = bulge(work, a, b);
  visitVertexArrays(
      [&mesh, a, b](auto array) { (mesh.*array).push_back(0.5f * ((mesh.*array)[a] + (mesh.*array)[b])); });
  mesh.position[i] += offset;
  vec3 &n = mesh.normal[i], &t = mesh.tangent[i];
  n = glm::normalize(glm::length(n) > 0.1f ? n : mesh.normal[a]);
  const vec3 along = t - n * glm::dot(n, t);
  t = glm::normalize(glm::length(along) > 0.1f ? along : mesh.tangent[a] - n * glm::dot(n, mesh.tangent[a]));
  work.isSharp.push_back(work.isSharp[a] || work.isSharp[b]);
  return i;
}

// Would the picture show that the edge is straight? Where its middle lies beside the surface by kOff, or light is
// interpolated over kFarthest.
struct ShownEdges {
  const Viewpoint& view;
  float height;  // px
  Halved halved;
  std::vector<vec3> picture = {};  // pictureFromWorld of every vertex asked for so far

  bool operator()(const Work& work, std::uint32_t a, std::uint32_t b) {
    constexpr float kOff = 0.2f, kFarthest = 80;  // px
    for (std::size_t i = picture.size(); i < work.mesh.position.size(); ++i)
      picture.push_back(pictureFromWorld(view, work.mesh.position[i]));
    const float farthest = halved == Halved::outlines ? kFarthest : kLongest * height;
    const vec3 p = picture[a], q = picture[b];
    if (std::max(p.z, q.z) < view.nearPlane) return false;
    const float halfWidth = 0.5f * view.aspect;
    if (std::max(p.x, q.x) < -halfWidth || std::min(p.x, q.x) > halfWidth) return false;
    if (std::max(p.y, q.y) < -0.5f || std::min(p.y, q.y) > 0.5f) return false;
    const vec3 d = (q - p) * height;
    if (d.x * d.x + d.y * d.y > farthest * farthest) return true;
    if (halved == Halved::largest) return false;
    const vec3 off = bulge(work, a, b);
    // Most edges pass here: across the view a metre is so many pixels, along it, at the picture's border, the one more.
    const float most = height * (0.5f / view.tangent + 1) / std::max(std::min(p.z, q.z), view.nearPlane);
    if (glm::dot(off, off) * most * most < kOff * kOff) return false;
    const vec3 middle = 0.5f * (work.mesh.position[a] + work.mesh.position[b]);
    const glm::vec2 moved = pictureFromWorld(view, middle + off) - pictureFromWorld(view, middle);
    return glm::length(moved) * height > kOff;
  }
};

struct EdgesAt {
  const std::vector<FineSpot>& spots;

  bool operator()(const Work& work, std::uint32_t a, std::uint32_t b) const {
    constexpr float kShare = 1.f / 3;
    const vec3 p = work.mesh.position[a], q = work.mesh.position[b];
    const float length = glm::distance(p, q);
    return std::any_of(spots.begin(), spots.end(), [&](const FineSpot& s) {
      return length > std::max(s.longestEdge, kShare * glm::distance(0.5f * (p + q), s.centre));
    });
  }
};

template <class IsLong>
std::uint32_t midpointOf(Work& work, IsLong& isLong, std::uint32_t a, std::uint32_t b) {
  if (a > b) std::swap(a, b);
  if (!isLong(work, a, b)) return kWhole;
  const auto [at, isNew] = work.midpoints.try_emplace(std::uint64_t(a) << 32 | b, 0);
  if (isNew) at->second = appendMidpoint(work, a, b);
  return at->second;
}

// The triangle cut at those of its edges' midpoints m (of ab, bc, ca) that there are.
void cutTriangle(std::array<std::uint32_t, 3> t, std::array<std::uint32_t, 3> m, std::vector<std::uint32_t>& out) {
  const auto add = [&out](std::uint32_t a, std::uint32_t b, std::uint32_t c) { out.insert(out.end(), {a, b, c}); };
  const auto halved = 3 - std::count(m.begin(), m.end(), kWhole);
  // Turned until one midpoint is m[0], of two m[0] and m[1].
  while ((halved == 1 && m[0] == kWhole) || (halved == 2 && m[2] != kWhole)) {
    std::rotate(t.begin(), t.begin() + 1, t.end());
    std::rotate(m.begin(), m.begin() + 1, m.end());
  }
  if (halved == 0) return add(t[0], t[1], t[2]);
  if (halved == 1) {
    add(t[0], m[0], t[2]);
    return add(m[0], t[1], t[2]);
  }
  add(m[0], t[1], m[1]);
  if (halved == 2) {
    add(t[0], m[0], m[1]);
    return add(t[0], m[1], t[2]);
  }
  add(t[0], m[0], m[2]);
  add(m[2], m[1], t[2]);
  add(m[0], m[1], m[2]);
}

// Triangles of which no edge is long go to `whole`, the others' pieces take their place in `index`. What is left whole
// stays so: its edges do not change.
template <class IsLong>
void halveEdges(Work& work, IsLong& isLong, std::vector<std::uint32_t>& index, std::vector<std::uint32_t>& whole) {
  std::vector<std::uint32_t> pieces;
  for (std::size_t k = 0; k < index.size(); k += 3) {
    const std::array<std::uint32_t, 3> t{index[k], index[k + 1], index[k + 2]};
    const std::array<std::uint32_t, 3> m{midpointOf(work, isLong, t[0], t[1]), midpointOf(work, isLong, t[1], t[2]),
                                         midpointOf(work, isLong, t[2], t[0])};
    const bool isWhole = m[0] == kWhole && m[1] == kWhole && m[2] == kWhole;
    cutTriangle(t, m, isWhole ? whole : pieces);
  }
  index.swap(pieces);
}

// Could the picture show one of the part's edges longer than kLongest? What is seen of an edge lies no farther from its
// vertices than it is long. Tissue stretches, hardly to more than twice its length.
bool mayBeLong(const SceneMesh& mesh, const MeshPart& part, const Viewpoint& v) {
  if (part.instrument) return false;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::uint32_t i = part.firstVertex; i < part.endVertex(); ++i)
    nearest = std::min(nearest, glm::length(mesh.position[i] - v.position));
  const float length = (part.moving ? 2 : 1) * part.longestEdge;
  const float corner = v.tangent * std::sqrt(1 + v.aspect * v.aspect),
              depth = (nearest - length) / std::hypot(1.f, corner);
  return length * (0.5f / v.tangent + 1) > kLongest * std::max(depth, v.nearPlane);
}

// Those of the last part of work.mesh, whose vertices begin at `first`.
void markSharp(Work& work, std::uint32_t first, const std::vector<std::uint32_t>& index) {
  constexpr float kSharp = 0.64f;  // cos 50 degrees, from the vertex's normal
  const SceneMesh& mesh = work.mesh;
  std::fill(work.isSharp.begin() + first, work.isSharp.end(), char(0));
  for (std::size_t k = 0; k < index.size(); k += 3) {
    const vec3 a = mesh.position[index[k]];
    const vec3 n = glm::cross(mesh.position[index[k + 1]] - a, mesh.position[index[k + 2]] - a);
    for (int c = 0; c < 3; ++c)
      if (glm::dot(n, mesh.normal[index[k + c]]) < kSharp * glm::length(n)) work.isSharp[index[k + c]] = 1;
  }
}

// `out` is `mesh` with the long edges of the parts that `isHalved` names halved, and halved again. Unless it is to be
// `rounded`, what is halved keeps its place everywhere.
template <class IsLong>
void copyHalved(const SceneMesh& mesh, const std::vector<char>& isHalved, bool rounded, IsLong isLong, SceneMesh& out) {
  out.resizeVertices(0);
  out.index.clear();
  out.parts.clear();
  Work work{out};
  std::vector<std::uint32_t> index;
  for (MeshPart part : mesh.parts) {
    const auto first = std::uint32_t(out.position.size()), firstIndex = std::uint32_t(out.index.size());
    index.assign(mesh.index.begin() + part.firstIndex, mesh.index.begin() + part.endIndex());
    for (std::uint32_t& corner : index) corner += first - part.firstVertex;
    appendVertices(mesh, part, out);
    work.isSharp.resize(out.position.size(), 1);
    if (rounded) markSharp(work, first, index);
    const int halvings = isHalved[out.parts.size()] ? kMostHalvings : 0;
    for (int k = 0; k < halvings && !index.empty(); ++k) halveEdges(work, isLong, index, out.index);
    out.index.insert(out.index.end(), index.begin(), index.end());
    part.firstVertex = first;
    part.vertexCount = std::uint32_t(out.position.size()) - first;
    part.firstIndex = firstIndex;
    part.indexCount = std::uint32_t(out.index.size()) - firstIndex;
    out.parts.push_back(part);
  }
}

}  // namespace

float longestEdge(const SceneMesh& mesh, const MeshPart& part) {
  float most = 0;
  for (std::uint32_t k = part.firstIndex; k < part.endIndex(); k += 3)
    for (int e = 0; e < 3; ++e) {
      const vec3 d = mesh.position[mesh.index[k + e]] - mesh.position[mesh.index[k + (e + 1) % 3]];
      most = std::max(most, glm::dot(d, d));
    }
  return std::sqrt(most);
}

bool tessellate(const SceneMesh& mesh, const Viewpoint& view, int pictureHeight, Halved halved, SceneMesh& out) {
  std::vector<char> isHalved;
  for (const MeshPart& part : mesh.parts)
    isHalved.push_back(halved == Halved::outlines ? !part.instrument : mayBeLong(mesh, part, view));
  if (std::count(isHalved.begin(), isHalved.end(), 1) == 0) return false;
  copyHalved(mesh, isHalved, halved == Halved::outlines, ShownEdges{view, float(pictureHeight), halved}, out);
  return true;
}

bool refine(const SceneMesh& mesh, const std::vector<FineSpot>& spots, SceneMesh& out) {
  if (spots.empty()) return false;
  std::vector<char> isHalved(mesh.parts.size(), 0);
  for (const FineSpot& spot : spots) isHalved[spot.part] = 1;
  copyHalved(mesh, isHalved, false, EdgesAt{spots}, out);
  return true;
}

}  // namespace medulla
