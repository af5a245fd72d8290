#include "render/model_view.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>

#include "render/across.h"
#include "render/gl_functions.h"
#include "render/shaders.h"

namespace medulla {
namespace {

constexpr float kTau = 2 * std::numbers::pi_v<float>;
constexpr std::array<int, 3> kRings = {8, 20, 48};
constexpr std::array<float, 2> kFinerAbove = {0.012f, 0.06f};  // projected radius, picture heights
constexpr glm::vec3 kBackdropColour{0.78f, 0.80f, 0.84f};      // linear RGB, of the shaders' backdrop
constexpr float kFarthestFaded = 0.45f;

}  // namespace

ModelView::UnitMesh ModelView::makeUnitMesh(const std::vector<glm::vec3>& positions,
                                            const std::vector<glm::vec3>& normals,
                                            const std::vector<unsigned>& indices) {
  std::vector<glm::vec3> interleaved;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    interleaved.push_back(positions[i]);
    interleaved.push_back(normals[i]);
  }
  UnitMesh m;
  m.indexCount = int(indices.size());
  glGenVertexArrays(1, &m.vertexArray);
  glGenBuffers(1, &m.vertices);
  glGenBuffers(1, &m.indices);
  glGenBuffers(1, &m.instances);
  glBindVertexArray(m.vertexArray);
  glBindBuffer(GL_ARRAY_BUFFER, m.vertices);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(interleaved.size() * sizeof(glm::vec3)), interleaved.data(), GL_STATIC_DRAW);
  readAttribute(0, 3, 2 * sizeof(glm::vec3), 0);
  readAttribute(1, 3, 2 * sizeof(glm::vec3), sizeof(glm::vec3));
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, m.indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(indices.size() * sizeof(unsigned)), indices.data(), GL_STATIC_DRAW);
  glBindBuffer(GL_ARRAY_BUFFER, m.instances);
  for (unsigned k = 0; k < 4; ++k) {
    readAttribute(2 + k, 4, sizeof(Instance), k * sizeof(glm::vec4));
    glVertexAttribDivisor(2 + k, 1);
  }
  glBindVertexArray(0);
  return m;
}

ModelView::UnitMesh ModelView::makeSphere(int rings) {
  std::vector<glm::vec3> p;
  std::vector<unsigned> index;
  const int around = 2 * rings;
  for (int j = 0; j <= rings; ++j)
    for (int i = 0; i <= around; ++i) {
      const float theta = 0.5f * kTau * float(j) / float(rings), phi = kTau * float(i) / float(around);
      p.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    }
  for (int j = 0; j < rings; ++j)
    for (int i = 0; i < around; ++i) {
      const unsigned a = unsigned(j * (around + 1) + i), b = a + unsigned(around) + 1;
      for (const unsigned k : {a, b, b + 1, a, b + 1, a + 1}) index.push_back(k);
    }
  return makeUnitMesh(p, p, index);
}

ModelView::UnitMesh ModelView::makeCylinder(int sides) {
  std::vector<glm::vec3> p, n;
  std::vector<unsigned> index;
  for (int s = 0; s <= sides; ++s) {
    const float a = kTau * float(s) / float(sides);
    for (const float z : {0.f, 1.f}) {
      p.emplace_back(std::cos(a), std::sin(a), z);
      n.emplace_back(std::cos(a), std::sin(a), 0);
    }
  }
  for (unsigned s = 0; s < unsigned(sides); ++s)
    for (const unsigned k : {0u, 2u, 3u, 0u, 3u, 1u}) index.push_back(2 * s + k);
  return makeUnitMesh(p, n, index);
}

ModelView::UnitMesh ModelView::makeCone(int sides) {
  std::vector<glm::vec3> p, n;
  std::vector<unsigned> index;
  for (int s = 0; s <= sides; ++s) {
    const float a = kTau * float(s) / float(sides);
    const glm::vec3 rim{std::cos(a), std::sin(a), 0};
    for (const glm::vec3& at : {rim, glm::vec3(0, 0, 1)}) {
      p.push_back(at);
      n.push_back(rim + glm::vec3(0, 0, 1));
    }
    for (const glm::vec3& at : {rim, glm::vec3(0)}) {
      p.push_back(at);
      n.emplace_back(0, 0, -1);
    }
  }
  for (unsigned s = 0; s < unsigned(sides); ++s)
    for (const unsigned k : {0u, 4u, 1u, 3u, 6u, 2u}) index.push_back(4 * s + k);
  return makeUnitMesh(p, n, index);
}

ModelView::ModelView(int pictureHeight) : pixel_(1 / float(pictureHeight)) {
  program_ = buildProgram("", kModelVertexShader, kModelFragmentShader);
  backdropProgram_ = buildProgram("", kBackdropVertexShader, kBackdropFragmentShader);
  glGenVertexArrays(1, &emptyArray_);
  for (std::size_t k = 0; k < spheres_.size(); ++k) spheres_[k] = makeSphere(kRings[k]);
  cylinder_ = makeCylinder(12);
  shaft_ = makeCylinder(32);
  cone_ = makeCone(32);
}

ModelView::~ModelView() {
  glDeleteProgram(program_);
  glDeleteProgram(backdropProgram_);
  glDeleteVertexArrays(1, &emptyArray_);
  for (const UnitMesh& m : {spheres_[0], spheres_[1], spheres_[2], cylinder_, shaft_, cone_}) {
    glDeleteVertexArrays(1, &m.vertexArray);
    for (const unsigned b : {m.vertices, m.indices, m.instances}) glDeleteBuffers(1, &b);
  }
}

void ModelView::drawBackdrop() const {
  glDisable(GL_DEPTH_TEST);
  glUseProgram(backdropProgram_);
  glBindVertexArray(emptyArray_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);
}

void ModelView::drawInstances(const UnitMesh& mesh, const std::vector<Instance>& instances) const {
  if (instances.empty()) return;
  glBindVertexArray(mesh.vertexArray);
  glBindBuffer(GL_ARRAY_BUFFER, mesh.instances);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(instances.size() * sizeof(Instance)), instances.data(), GL_STREAM_DRAW);
  glDrawElementsInstanced(GL_TRIANGLES, mesh.indexCount, GL_UNSIGNED_INT, nullptr, int(instances.size()));
}

void ModelView::setCamera(const Viewpoint& v, bool lines) const {
  // Lines run along a skin, now before it, now behind: hidden by it they would break into pieces.
  constexpr float kNearer = 0.06f;
  glUseProgram(program_);
  const auto uniform = [this](const char* name) { return glGetUniformLocation(program_, name); };
  glUniformMatrix4fv(uniform("clipFromWorld"), 1, GL_FALSE, glm::value_ptr(v.clipFromWorld));
  glUniform3fv(uniform("eye"), 1, glm::value_ptr(v.position));
  glUniform3fv(uniform("right"), 1, glm::value_ptr(v.right));
  glUniform3fv(uniform("up"), 1, glm::value_ptr(v.up));
  glUniform3fv(uniform("back"), 1, glm::value_ptr(v.back));
  glUniform1f(uniform("nearer"), lines ? kNearer : 0);
  glUniform1i(uniform("lines"), lines);
}

static glm::vec4 rowOf(int k, glm::vec3 x, glm::vec3 y, glm::vec3 z, glm::vec3 origin) {
  return {x[k], y[k], z[k], origin[k]};
}

// Places what reaches from 0 to 1 along z. a and b differ.
ModelView::Instance ModelView::rodInstance(glm::vec3 a, glm::vec3 b, float radius, glm::vec4 colour) {
  const glm::vec3 along = b - a, w = glm::normalize(along), x = radius * across(w), y = glm::cross(w, x);
  return {{rowOf(0, x, y, along, a), rowOf(1, x, y, along, a), rowOf(2, x, y, along, a)}, colour};
}

ModelView::Instance ModelView::ballInstance(glm::vec3 centre, float radius, glm::vec4 colour) {
  const glm::mat3 r(radius);
  const auto row = [&](int k) { return rowOf(k, r[0], r[1], r[2], centre); };
  return {{row(0), row(1), row(2)}, colour};
}

// Of spheres_.
static std::size_t levelOf(const Viewpoint& v, float depth, float radius) {
  const float size = 0.5f * radius / (std::max(depth, v.nearPlane) * v.tangent);
  return std::size_t(size > kFinerAbove[0]) + std::size_t(size > kFinerAbove[1]);
}

// What is thinner than a pixel breaks into dots.
float ModelView::atLeast(const Viewpoint& v, float depth, float radius) const {
  return std::max(radius, 0.6f * pixel_ * 2 * std::max(depth, v.nearPlane) * v.tangent);
}

glm::vec4 DepthFade::operator()(glm::vec4 colour, float depth) const {
  if (far <= near) return colour;
  const float share = kFarthestFaded * glm::clamp((depth - near) / (far - near), 0.f, 1.f);
  return {glm::mix(glm::vec3(colour), kBackdropColour, share), colour.a};
}

// A thing on its own keeps its colour.
static DepthFade fadeOf(const Viewpoint& v, const Drawing& drawing) {
  DepthFade fade{1e30f, -1e30f};
  const auto add = [&](glm::vec3 p) {
    const float depth = pictureFromWorld(v, p).z;
    fade.near = std::min(fade.near, depth);
    fade.far = std::max(fade.far, depth);
  };
  for (const DrawnBall& b : drawing.balls) add(b.centre);
  for (const Segment& s : drawing.segments) {
    add(s.a);
    add(s.b);
  }
  return fade;
}

void ModelView::sortBalls(const Viewpoint& view, const std::vector<DrawnBall>& balls, const DepthFade& fade) {
  constexpr float kDense = 0.3f;
  for (auto& level : opaque_) level.clear();
  for (auto& level : dense_) level.clear();
  seenThrough_.clear();
  for (const DrawnBall& ball : balls) {
    const float depth = pictureFromWorld(view, ball.centre).z, radius = atLeast(view, depth, ball.radius);
    const std::size_t level = levelOf(view, depth, radius);
    const Instance i = ballInstance(ball.centre, radius, fade(ball.colour, depth));
    if (ball.colour.a >= 1)
      opaque_[level].push_back(i);
    else
      seenThrough_.push_back({depth, level, i});
    if (ball.colour.a < 1 && ball.colour.a > kDense) dense_[level].push_back(i);
  }
  // Farthest first, each over what is behind it.
  std::stable_sort(seenThrough_.begin(), seenThrough_.end(),
                   [](const SeenThrough& a, const SeenThrough& b) { return a.depth > b.depth; });
}

void ModelView::placeRods(const Viewpoint& view, const Drawing& drawing, const DepthFade& fade, bool allOpaque) {
  // Light on dark or dark on light, thin lines look fainter than they are; the thinnest are to be seen.
  constexpr float kStrength = 1.6f, kFaintest = 0.25f;
  rods_.clear();
  shafts_.clear();
  heads_.clear();
  const auto depthOf = [&view](glm::vec3 a, glm::vec3 b) { return pictureFromWorld(view, 0.5f * (a + b)).z; };
  for (const Segment& s : drawing.segments) {
    if (s.a == s.b) continue;
    const float depth = depthOf(s.a, s.b), radius = atLeast(view, depth, s.radius);
    // What is widened to a pixel covers a share of it: opaque, a small mesh would be a mush that hides everything.
    const float cover = allOpaque ? 1.f : std::max(kStrength * s.radius / radius, kFaintest);
    glm::vec4 colour = fade(s.colour, depth);
    const bool faint = cover < 1;
    if (faint) colour.a *= cover;
    (faint ? faintRods_ : rods_).push_back(rodInstance(s.a, s.b, radius, colour));
  }
  for (const Arrow& arrow : drawing.arrows) {
    const glm::vec3 along = arrow.to - arrow.from;
    const float length = glm::length(along);
    if (length <= 0) continue;
    // A short arrow is a small one: its head takes no more than its half.
    const float head = std::min(8 * arrow.radius, 0.5f * length), radius = head / 8;
    const glm::vec3 neck = arrow.to - head / length * along;
    const float depth = depthOf(arrow.from, arrow.to), shaftRadius = atLeast(view, depth, radius);
    const glm::vec4 colour = fade(arrow.colour, depth);
    shafts_.push_back(rodInstance(arrow.from, neck, shaftRadius, colour));
    // A shaft is a tube: seen from behind it would be open.
    opaque_[levelOf(view, depth, shaftRadius)].push_back(ballInstance(arrow.from, shaftRadius, colour));
    heads_.push_back(rodInstance(neck, arrow.to, 3 * radius, colour));
  }
}

void ModelView::draw(const Viewpoint& view, const Drawing& drawing, ModelPlace place) {
  faintRods_.clear();
  if (drawing.empty()) return;
  const DepthFade depthFade = place == ModelPlace::backdrop ? fadeOf(view, drawing) : DepthFade{};
  sortBalls(view, drawing.balls, depthFade);
  placeRods(view, drawing, depthFade, place == ModelPlace::overlay);
  setCamera(view);
  glEnable(GL_CULL_FACE);
  glFrontFace(GL_CW);  // the picture is drawn upside down: see Viewpoint::clipFromWorld
  for (std::size_t k = 0; k < opaque_.size(); ++k) drawInstances(spheres_[k], opaque_[k]);
  drawInstances(cylinder_, rods_);
  drawInstances(shaft_, shafts_);
  drawInstances(cone_, heads_);
  drawBallsSeenThrough(place == ModelPlace::backdrop && !faintRods_.empty());
  glDisable(GL_CULL_FACE);
}

static void startBlending() {
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  glDepthMask(GL_FALSE);  // of two, one within the other, both are seen
}
static void stopBlending() {
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
}

// hide: what is drawn later lies behind the denser ones.
void ModelView::drawBallsSeenThrough(bool hide) const {
  startBlending();
  for (const SeenThrough& s : seenThrough_) drawInstances(spheres_[s.level], {s.instance});
  stopBlending();
  if (!hide) return;
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  for (std::size_t k = 0; k < dense_.size(); ++k) drawInstances(spheres_[k], dense_[k]);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

void ModelView::drawFaint(const Viewpoint& view) const {
  if (faintRods_.empty()) return;
  setCamera(view, true);
  glEnable(GL_CULL_FACE);
  startBlending();
  drawInstances(cylinder_, faintRods_);
  stopBlending();
  glDisable(GL_CULL_FACE);
}

}  // namespace medulla
