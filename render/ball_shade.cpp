#include "render/ball_shade.h"

#include <algorithm>
#include <cmath>

namespace medulla {
namespace {

using glm::ivec3;
using glm::vec3;

constexpr float kReach = 2.6f;  // radii from a ball's centre: what it hides fades to nothing there

vec3 reachOf(const ShadeBall& ball) {
  return vec3(kReach * ball.radius);
}

// 0..1: of the light that reaches a patch.
float hiddenBy(const ShadeBall& ball, vec3 position, vec3 normal) {
  constexpr float kLeast = 1 / (kReach * kReach);
  const vec3 to = ball.centre - position;
  const float squared = glm::dot(to, to), radius2 = ball.radius * ball.radius;
  const float above = glm::dot(normal, to);
  if (squared * kLeast >= radius2 || above <= 0) return 0;
  const float share = std::min(radius2 / squared, 1.f);
  return above / std::sqrt(squared) * (share - kLeast) / (1 - kLeast);
}

}  // namespace

void BallShade::sortIn(const Balls& balls) {
  balls_.clear();
  for (std::uint32_t part = 0; part < balls.size(); ++part)
    if (balls[part])
      for (const ShadeBall& ball : *balls[part]) balls_.push_back({ball, part});
  if (balls_.empty()) return;
  vec3 high = low_ = balls_[0].ball.centre;
  float widest = 0;
  for (const Held& held : balls_) {
    low_ = glm::min(low_, held.ball.centre - reachOf(held.ball));
    high = glm::max(high, held.ball.centre + reachOf(held.ball));
    widest = std::max(widest, held.ball.radius);
  }
  constexpr float kMostCells = 40;  // along the longest side
  const vec3 size = high - low_;
  perMetre_ = 1 / std::max(widest, std::max({size.x, size.y, size.z}) / kMostCells);
  cells_ = ivec3(size * perMetre_) + 1;
  first_.assign(std::size_t(cells_.x) * cells_.y * cells_.z + 1, 0);
  const auto visitCells = [this](const ShadeBall& ball, const auto& visit) {
    const ivec3 from = ivec3((ball.centre - reachOf(ball) - low_) * perMetre_),
                to = glm::min(ivec3((ball.centre + reachOf(ball) - low_) * perMetre_), cells_ - 1);
    for (int z = from.z; z <= to.z; ++z)
      for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x) visit((std::size_t(z) * cells_.y + y) * cells_.x + x);
  };
  for (const Held& held : balls_) visitCells(held.ball, [this](std::size_t cell) { ++first_[cell]; });
  std::uint32_t sum = 0;
  for (std::uint32_t& first : first_) first = sum += first;
  inCell_.resize(sum);
  for (std::uint32_t k = std::uint32_t(balls_.size()); k-- > 0;)
    visitCells(balls_[k].ball, [&](std::size_t cell) { inCell_[--first_[cell]] = k; });
}

float BallShade::leftAt(vec3 position, vec3 normal, std::uint32_t part) const {
  const vec3 at = (position - low_) * perMetre_;
  if (!(glm::all(glm::greaterThanEqual(at, vec3(0))) && glm::all(glm::lessThan(at, vec3(cells_))))) return 1;
  const ivec3 c(at);
  const std::size_t cell = (std::size_t(c.z) * cells_.y + c.y) * cells_.x + c.x;
  float left = 1;
  for (std::uint32_t k = first_[cell]; k < first_[cell + 1];) {
    const std::uint32_t of = balls_[inCell_[k]].part;
    float sum = 0;  // of fourth powers, whose root is about the largest, without its creases
    for (; k < first_[cell + 1] && balls_[inCell_[k]].part == of; ++k) {
      if (of == part) continue;
      const float hidden = hiddenBy(balls_[inCell_[k]].ball, position, normal);
      sum += hidden * hidden * hidden * hidden;
    }
    if (sum > 0) left *= 1 - std::min(std::sqrt(std::sqrt(sum)), 1.f);
  }
  return left;
}

void BallShade::bake(const SceneMesh& mesh, const Balls& atRest) {
  left_.assign(mesh.position.size(), 1.f);
  Balls staying = atRest;
  for (std::size_t part = 0; part < staying.size(); ++part)
    if (mesh.parts[part].travels) staying[part] = nullptr;
  sortIn(staying);
  if (balls_.empty()) return;
  for (std::uint32_t p = 0; p < mesh.parts.size(); ++p) {
    const MeshPart& part = mesh.parts[p];
    for (std::uint32_t i = part.firstVertex; !part.travels && i < part.endVertex(); ++i)
      left_[i] = leftAt(mesh.position[i], mesh.normal[i], p);
  }
}

void BallShade::apply(const Balls& balls, vec3 eye, SceneMesh& mesh) {
  constexpr float kAway = -0.3f;  // cosine: beyond it no triangle of the vertex shows
  constexpr float kLeast = 0.1f;  // what was all but closed at rest does not become a lamp
  sortIn(balls);
  if (balls_.empty()) return;
  for (std::uint32_t p = 0; p < mesh.parts.size(); ++p) {
    const MeshPart& part = mesh.parts[p];
    for (std::uint32_t i = part.firstVertex; i < part.endVertex(); ++i) {
      const vec3 toEye = eye - mesh.position[i];
      if (glm::dot(mesh.normal[i], toEye) < kAway * glm::length(toEye)) continue;
      const float left = leftAt(mesh.position[i], mesh.normal[i], p);
      if (left != left_[i])
        mesh.openness[i] = std::min(mesh.openness[i] * std::max(left, 0.f) / std::max(left_[i], kLeast), 1.f);
    }
  }
}

}  // namespace medulla
