#include "render/haze.h"

#include <cmath>
#include <vector>

#include "render/gl_functions.h"
#include "render/noise.h"
#include "render/shaders.h"

namespace medulla {
namespace {

using glm::vec3;

// The background is smooth: its colour is computed at the corners of a grid, 16:9 as most pictures are.
constexpr int kColumns = 96, kRows = 54;

// Doublings of brightness from the level to the zenith. Sunlit water, seen from within, is about that steep.
constexpr float kSteepness = 2.6f;

struct Corner {
  glm::vec2 place;  // clip space
  vec3 colour;      // linear RGB
};

}  // namespace

HazeField::HazeField(const Light& light, const Camera& camera, float time)
    : colour_(light.haze->colour),
      lamp_(0, 1, 0),
      distance_(light.haze->distance),
      shafts_(light.caustics),
      time_(time) {
  const vec3 toLamp = light.position ? *light.position - camera.target : lamp_;
  if (const float length = glm::length(toLamp); length > 0) lamp_ = toLamp / length;
  const vec3 any = std::abs(lamp_.x) < 0.7f ? vec3(1, 0, 0) : vec3(0, 0, 1);
  aside_ = glm::normalize(glm::cross(any, lamp_));
  across_ = glm::cross(lamp_, aside_);
}

vec3 HazeField::toward(vec3 direction) const {
  const vec3 level = colour_ * std::exp2(kSteepness * direction.y);
  if (shafts_ <= 0) return level;
  // A shaft lies in a plane with the eye and the lamp: it has one angle about the lamp.
  constexpr float kShafts = 5, kDrift = 0.25f;  // noise cells per radian, per s
  const glm::vec2 about(glm::dot(direction, aside_), glm::dot(direction, across_));
  const float length = glm::length(about);
  if (length < 1e-4f) return level;
  const glm::vec2 on = about * (kShafts / length);
  const float wide = valueNoise({on.x, on.y, kDrift * time_}),
              fine = valueNoise({2.7f * on.x, 2.7f * on.y, 20 + 1.6f * kDrift * time_});
  const float fade = smoothStep(-0.5f, 0.5f, glm::dot(direction, lamp_));
  return level * (1 + shafts_ * fade * (1.1f * wide + 0.7f * fine - 0.9f));
}

vec3 HazeField::below() const {
  return colour_ * std::exp2(-0.5f * kSteepness);
}
vec3 HazeField::above() const {
  return colour_ * std::exp2(0.5f * kSteepness);
}

float HazeField::veil(float distance) const {
  return 1 - std::exp(-distance / distance_);
}

float causticAt(vec3 p, vec3 toLight, float contrast, float time) {
  constexpr float kCellSide = 0.42f, kPace = 0.8f;  // m between lines; noise cells per s
  // Along the light to the level y = 0, turned off the axes of the noise's lattice.
  const float up = std::max(toLight.y, 0.2f);
  const float x = p.x - toLight.x * p.y / up, z = p.z - toLight.z * p.y / up;
  const float u = (0.8f * x + 0.6f * z) / kCellSide, v = (0.8f * z - 0.6f * x) / kCellSide;
  // Lines where a noise passes its middle value; two nets that cross.
  const auto net = [&](float a, float b, float c) {
    // Across the lattice's planes, which would dim and brighten all lines together as time passes them.
    const float ridge = 1 - std::abs(2 * valueNoise({a, b, c + 0.6f * a + 0.45f * b}) - 1);
    return ridge * ridge * ridge * ridge;
  };
  // The factors give the sum a mean of 1.
  const float lines = net(u, v, kPace * time) * 0.6f + net(1.7f * v + 31, 1.7f * u + 17, 40 + kPace * time) * 0.4f;
  return 1 + contrast * (4.5f * lines * lines + 0.37f * lines - 1);
}

HazePass::HazePass() {
  program_ = buildProgram("", kHazeVertexShader, kHazeFragmentShader);
  std::vector<unsigned> index;
  for (unsigned j = 0; j < kRows; ++j)
    for (unsigned i = 0; i < kColumns; ++i) {
      const unsigned a = j * (kColumns + 1) + i, b = a + kColumns + 1;
      index.insert(index.end(), {a, b, b + 1, a, b + 1, a + 1});
    }
  indexCount_ = int(index.size());
  glGenVertexArrays(1, &vertexArray_);
  glGenBuffers(1, &vertices_);
  glGenBuffers(1, &indices_);
  glBindVertexArray(vertexArray_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(index.size() * sizeof(unsigned)), index.data(), GL_STATIC_DRAW);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  readAttribute(0, 2, sizeof(Corner), offsetof(Corner, place));
  readAttribute(1, 3, sizeof(Corner), offsetof(Corner, colour));
}

HazePass::~HazePass() {
  glDeleteProgram(program_);
  glDeleteVertexArrays(1, &vertexArray_);
  for (const unsigned b : {vertices_, indices_}) glDeleteBuffers(1, &b);
}

void HazePass::draw(const Viewpoint& view, const HazeField& haze) {
  std::vector<Corner> corners;
  corners.reserve(std::size_t(kColumns + 1) * (kRows + 1));
  for (int j = 0; j <= kRows; ++j)
    for (int i = 0; i <= kColumns; ++i) {
      // A little more than the picture: its last column must not lie on the grid's edge.
      const glm::vec2 at = 1.02f * glm::vec2(float(i) / kColumns - 0.5f, 0.5f - float(j) / kRows);
      const glm::vec2 picture = at * glm::vec2(view.aspect, 1);  // heights, y up
      const vec3 ray = (view.right * picture.x + view.up * picture.y) * (2 * view.tangent) - view.back;
      corners.push_back({glm::vec2(2 * at.x, -2 * at.y) / view.overscan,
                         haze.toward(glm::normalize(ray)) * vignetteAt(view, picture)});
    }
  glUseProgram(program_);
  glBindVertexArray(vertexArray_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(corners.size() * sizeof(Corner)), corners.data(), GL_STREAM_DRAW);
  glDepthFunc(GL_LEQUAL);  // at the far end, where nothing was drawn
  glDrawElements(GL_TRIANGLES, indexCount_, GL_UNSIGNED_INT, nullptr);
  glDepthFunc(GL_LESS);
}

}  // namespace medulla
