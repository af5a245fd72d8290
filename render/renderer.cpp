#include "render/renderer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>

#include "render/ball_shade.h"
#include "render/gl_context.h"
#include "render/gl_functions.h"
#include "render/haze.h"
#include "render/instrument_mesh.h"
#include "render/model_view.h"
#include "render/post_process.h"
#include "render/surface_bake.h"
#include "render/tessellation.h"
#include "render/tissue_pass.h"
#include "render/touch.h"

namespace medulla {
namespace {

constexpr float kSeenThroughOpacity = 0.38f;  // of moving skin over the model in ViewKind::both

// Colour and depth off screen. Floating-point depth: with 24 bits llvmpipe is a third slower.
struct Framebuffer {
  unsigned id = 0, buffers[2] = {0, 0};

  Framebuffer(int width, int height) {
    glGenFramebuffers(1, &id);
    glBindFramebuffer(GL_FRAMEBUFFER, id);
    glGenRenderbuffers(2, buffers);
    const unsigned format[] = {GL_RGBA8, GL_DEPTH_COMPONENT32F}, point[] = {GL_COLOR_ATTACHMENT0, GL_DEPTH_ATTACHMENT};
    for (int k = 0; k < 2; ++k) {
      glBindRenderbuffer(GL_RENDERBUFFER, buffers[k]);
      glRenderbufferStorage(GL_RENDERBUFFER, format[k], width, height);
      glFramebufferRenderbuffer(GL_FRAMEBUFFER, point[k], GL_RENDERBUFFER, buffers[k]);
    }
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw std::runtime_error("OpenGL cannot draw " + std::to_string(width) + "x" + std::to_string(height) +
                               " pixels, expected a smaller size or a lower quality");
  }
  ~Framebuffer() {
    glDeleteRenderbuffers(2, buffers);
    glDeleteFramebuffers(1, &id);
  }
};

void checkSettings(const RendererSettings& s) {
  const auto bad = [](int v) { return v < kPictureSideMin || v > kPictureSideMax; };
  if (bad(s.width) || bad(s.height))
    throw std::runtime_error("picture size " + std::to_string(s.width) + "x" + std::to_string(s.height) +
                             ", expected whole numbers from " + std::to_string(kPictureSideMin) + " to " +
                             std::to_string(kPictureSideMax));
  assert(s.supersample >= 1 && s.supersample <= 4);
}

// sRGB, 8 bits, to light in 16 bits, and back.
struct LightTables {
  std::array<std::uint16_t, 256> light;
  std::vector<std::uint8_t> shown = std::vector<std::uint8_t>(1 << 16);

  LightTables() {
    for (int v = 0; v < 256; ++v) light[v] = static_cast<std::uint16_t>(std::lround(65535 * lightFromSrgb(v / 255.0)));
    for (int v = 0, next = 0; v < 256; ++v) {
      const int until = v < 255 ? (light[v] + light[v + 1] + 1) / 2 : 1 << 16;
      for (; next < until; ++next) shown[next] = static_cast<std::uint8_t>(v);
    }
  }
};

// The code above the light or the one below it, above in as many pixels of sixteen as it lies between the two: means of
// several pixels have lost the tremble by which each hides the steps of what is smooth.
std::uint8_t ditheredCode(const LightTables& tables, unsigned light, int x, int y) {
  static constexpr std::uint8_t ordered[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  const std::uint8_t nearest = tables.shown[light], below = nearest - (tables.light[nearest] > light);
  if (below == 255) return below;
  const unsigned from = tables.light[below], step = tables.light[below + 1] - from;
  return std::uint8_t(below + (32 * (light - from) > (2 * ordered[y % 4][x % 4] + 1u) * step));
}

// Each pixel of `out` becomes the mean of `factor`^2 pixels of `fine`, in light: means of coded values darken edges.
void reduce(const Image& fine, int factor, const LightTables& tables, Image& out) {
  const unsigned count = unsigned(factor * factor);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      unsigned sum[3] = {count / 2, count / 2, count / 2};
      for (int row = 0; row < factor; ++row) {
        const std::uint8_t* p =
            &fine.pixels[4 * (std::size_t(y * factor + row) * fine.width + std::size_t(x) * factor)];
        for (int k = 0; k < factor; ++k, p += 4)
          for (int c = 0; c < 3; ++c) sum[c] += tables.light[p[c]];
      }
      std::uint8_t* to = &out.pixels[4 * (std::size_t(y) * out.width + x)];
      for (int c = 0; c < 3; ++c) to[c] = ditheredCode(tables, sum[c] / count, x, y);
      to[3] = 255;
    }
}

}  // namespace

struct Renderer::Data {
  RendererSettings settings;
  std::unique_ptr<GlContext> context;
  int fineWidth, fineHeight;  // px, as drawn; a picture is smaller by `supersample`
  int largestViewport = 0;    // px: OpenGL would cut what is larger without a word
  Framebuffer framebuffer;
  TissuePass tissue;
  HazePass background;
  ModelView model;
  std::optional<PostProcess> finePost;  // of supersampled pictures
  PostProcess post;
  LightTables tables;
  Image fine;
  std::deque<bool> begun;  // of pictures not yet taken, the oldest first: whether they are round
  Image held;              // the older of two, read back

  SceneMesh mesh;  // surfaces at their place in this picture, then instruments
  SceneMesh rest;  // surfaces at rest, baked
  BallShade ballShade;
  std::vector<std::vector<ShadeBall>> restBalls;  // per surface
  SceneMesh toolsAlone;                           // of the model view, which has no surfaces
  SceneMesh refined;                              // `mesh` where a tool holds some of it
  SceneMesh* shown = &mesh;                       // or toolsAlone, or refined
  SceneMesh finer;                                // `shown` for a picture that is too large or too near for it
  bool isFiner = false;
  bool baked = true;
  std::optional<HazeField> haze;
  LightView lightView;
  ShadowMap shadow;
  VisibleTriangles seen;
  VertexLight lit;
  DrawLists lists;

  explicit Data(const RendererSettings& s)
      : settings(s),
        context(makeGlContext(s.context)),
        fineWidth(s.width * s.supersample),
        fineHeight(s.height * s.supersample),
        framebuffer(fineWidth, fineHeight),
        tissue(shadowSideFor(s.height), s.supersample > 1),
        model(s.height),
        post(s.width, s.height),
        shadow(shadowSideFor(s.height)),
        seen(fineWidth, fineHeight) {
    if (s.supersample > 1) finePost.emplace(fineWidth, fineHeight);
    tissue.addLook(findLook("steel"));
    GLint most[2] = {};
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, most);
    largestViewport = std::min(most[0], most[1]);
    glFinish();
    spreadRasterThreads();
  }
  ~Data() { context->makeCurrent(); }

  const SceneMesh& drawn() const { return isFiner ? finer : *shown; }
  const ShadowMap* shadowIfOn() const { return settings.shadows ? &shadow : nullptr; }

  void bake();
  void placeSurfaces(const Picture& picture);
  void placeInstruments(const Picture& picture, const Viewpoint& view);
  void lightAndSort(const Picture& picture, const Viewpoint& view);
  void draw(const Picture& picture, const Viewpoint& view);
  void readBack(Image& out) const;
  void finish(bool round, Image& out);
};

void Renderer::Data::bake() {
  if (baked) return;
  for (MeshPart& part : rest.parts) {
    part.longestEdge = longestEdge(rest, part);
    computeNormals(rest, part);
    bakeTextureCoordinates(rest, part);
    computeTangents(rest, part);
    findSeams(rest, part);
    bakeAlbedo(rest, part);
    tissue.addLook(*part.look);
  }
  bakeOpenness(rest);
  BallShade::Balls atRest;
  for (const std::vector<ShadeBall>& balls : restBalls) atRest.push_back(&balls);
  ballShade.bake(rest, atRest);
  mesh = rest;
  baked = true;
}

void Renderer::Data::placeSurfaces(const Picture& picture) {
  shown = picture.view == ViewKind::model ? &toolsAlone : &mesh;
  removeInstruments(*shown);
  if (shown == &toolsAlone) return;
  std::fill(mesh.blanch.begin(), mesh.blanch.end(), 0.f);
  std::copy(rest.openness.begin(), rest.openness.end(), mesh.openness.begin());
  BallShade::Balls balls;
  for (std::size_t p = 0; p < mesh.parts.size(); ++p) {
    MeshPart& part = mesh.parts[p];
    const auto first = std::ptrdiff_t(part.firstVertex), last = first + std::ptrdiff_t(part.vertexCount);
    const bool given = p < picture.surfaces.size() && !picture.surfaces[p].positions.empty();
    part.moving = given;
    if (given) {
      const std::vector<glm::vec3>& positions = picture.surfaces[p].positions;
      assert(positions.size() == part.vertexCount);
      std::copy(positions.begin(), positions.end(), mesh.position.begin() + first);
      computeNormals(mesh, part);
      applyStrain(rest, mesh, part);
      computeTangents(mesh, part);
    } else {
      std::copy(rest.position.begin() + first, rest.position.begin() + last, mesh.position.begin() + first);
      std::copy(rest.normal.begin() + first, rest.normal.begin() + last, mesh.normal.begin() + first);
      std::copy(rest.tangent.begin() + first, rest.tangent.begin() + last, mesh.tangent.begin() + first);
      std::copy(rest.area.begin() + first, rest.area.begin() + last, mesh.area.begin() + first);
    }
    balls.push_back(given ? &picture.surfaces[p].balls : &restBalls[p]);
  }
  ballShade.apply(balls, picture.camera.position, mesh);
}

void Renderer::Data::placeInstruments(const Picture& picture, const Viewpoint& view) {
  std::vector<FineSpot> spots;
  for (const Instrument& i : picture.instruments)
    if (const std::optional<FineSpot> spot = spotBetweenJaws(i, *shown)) spots.push_back(*spot);
  if (refine(*shown, spots, refined)) shown = &refined;
  for (const Instrument& i : picture.instruments)
    if (i.touching) applyTouch(i, *shown);
  for (const Instrument& i : picture.instruments) shadeAround(i, *shown);
  for (const Instrument& i : picture.instruments) appendInstrument(i, view, fineHeight, *shown);
}

void Renderer::Data::lightAndSort(const Picture& picture, const Viewpoint& view) {
  // The model view has a backdrop of its own.
  haze.reset();
  if (picture.light.haze && picture.view != ViewKind::model) haze.emplace(picture.light, picture.camera, picture.time);
  const Halved halved = fineHeight >= kLinesOfMeshes ? Halved::outlines : Halved::largest;
  isFiner = tessellate(*shown, view, settings.height, halved, finer);
  lightView = makeLightView(picture.light, view, picture.camera, drawn());
  if (settings.shadows) renderShadowMap(drawn(), lightView, shadow);
  findVisibleTriangles(drawn(), view, picture.view == ViewKind::tissue, seen);
  lightVertices(drawn(), seen, view, picture, lightView, haze ? &*haze : nullptr, shadowIfOn(), lit);
  sortByVariant(drawn(), seen, lit, shadowIfOn(), fineHeight, lists);
}

void Renderer::Data::draw(const Picture& picture, const Viewpoint& view) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id);
  glViewport(0, 0, fineWidth, fineHeight);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glClearColor(0.02f, 0.01f, 0.01f, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  if (picture.view == ViewKind::model) model.drawBackdrop();
  const auto beyond = [&view](int side) { return int(float(side) * 0.5f * (view.overscan - 1)); };
  const int x = beyond(fineWidth), y = beyond(fineHeight);
  glViewport(-x, -y, fineWidth + 2 * x, fineHeight + 2 * y);
  if (view.round) tissue.drawMask(view);
  tissue.upload(lit, lists, shadowIfOn());

  const std::size_t parts = drawn().parts.size();
  std::vector<char> opaque(parts), seenThrough(parts);
  for (std::size_t p = 0; p < parts; ++p) {
    seenThrough[p] = picture.view == ViewKind::both && drawn().parts[p].moving;
    opaque[p] = !seenThrough[p];
  }
  tissue.draw(drawn(), lists, opaque, view, lightView, 1);
  if (haze) background.draw(view, *haze);
  model.draw(view, picture.model, picture.view == ViewKind::model ? ModelPlace::backdrop : ModelPlace::scene);
  if (picture.view == ViewKind::both) tissue.draw(drawn(), lists, seenThrough, view, lightView, kSeenThroughOpacity);
  model.drawFaint(view);
  if (!picture.overlay.empty()) glClear(GL_DEPTH_BUFFER_BIT);
  model.draw(view, picture.overlay, ModelPlace::overlay);
}

void Renderer::Data::readBack(Image& out) const {
  out.width = fineWidth;
  out.height = fineHeight;
  out.pixels.resize(4ul * fineWidth * fineHeight);
  glReadPixels(0, 0, fineWidth, fineHeight, GL_RGBA, GL_UNSIGNED_BYTE, out.pixels.data());
  if (const unsigned error = glGetError()) throw std::runtime_error("OpenGL error " + std::to_string(error));
}

Renderer::Renderer(const RendererSettings& settings) {
  checkSettings(settings);
  data_ = std::make_unique<Data>(settings);
}
Renderer::~Renderer() = default;

void Renderer::addSurface(SurfaceShape shape) {
  SceneMesh& m = data_->rest;
  MeshPart part;
  part.look = &findLook(shape.look);
  part.travels = shape.travels;
  data_->restBalls.push_back(std::move(shape.restBalls));
  part.firstVertex = std::uint32_t(m.position.size());
  part.vertexCount = std::uint32_t(shape.restPositions.size());
  part.firstIndex = std::uint32_t(m.index.size());
  part.indexCount = std::uint32_t(3 * shape.triangles.size());
  m.position.insert(m.position.end(), shape.restPositions.begin(), shape.restPositions.end());
  m.resizeVertices(m.position.size());
  for (const auto& t : shape.triangles)
    for (const std::uint32_t v : t) {
      assert(v < part.vertexCount);
      m.index.push_back(part.firstVertex + v);
    }
  m.parts.push_back(part);
  data_->baked = false;
}

// Edges are smoothed as drawn; the lens's halo and rim are as wide in a picture whatever its quality.
void Renderer::Data::finish(bool round, Image& out) {
  if (settings.supersample > 1) {
    if (settings.antialias) finePost->smoothEdges(fine);
    out.width = settings.width;
    out.height = settings.height;
    out.pixels.resize(4ul * out.width * out.height);
    reduce(fine, settings.supersample, tables, out);
  } else if (settings.antialias) {
    post.smoothEdges(out);
  }
  if (!round) return;
  post.addGlare(out);
  post.fadeRim(out);
}

static void start(StageTimes* times, const char* stage) {
  if (times) times->start(stage);
}

void Renderer::begin(const Picture& picture, StageTimes* times) {
  Data& d = *data_;
  assert(d.begun.size() < 2);
  d.context->makeCurrent();
  const bool round = picture.endoscopeMask && picture.view != ViewKind::model;
  const Viewpoint view = makeViewpoint(picture.camera, aspect(), round,
                                       float(d.largestViewport) / float(std::max(d.fineWidth, d.fineHeight)));
  start(times, "bake");
  d.bake();
  start(times, "place");
  d.placeSurfaces(picture);
  d.placeInstruments(picture, view);
  start(times, "light");
  d.lightAndSort(picture, view);
  start(times, "read back");
  if (!d.begun.empty()) d.readBack(d.held);
  start(times, "draw");
  d.draw(picture, view);
  glFlush();
  d.begun.push_back(round);
  if (times) times->stop();
}

void Renderer::take(Image& out, StageTimes* times) {
  Data& d = *data_;
  assert(!d.begun.empty());
  d.context->makeCurrent();
  start(times, "read back");
  Image& drawn = d.settings.supersample > 1 ? d.fine : out;
  if (d.begun.size() == 2)
    std::swap(drawn, d.held);
  else
    d.readBack(drawn);
  start(times, "finish");
  d.finish(d.begun.front(), out);
  d.begun.pop_front();
  if (times) times->stop();
}

void Renderer::render(const Picture& picture, Image& out) {
  begin(picture);
  take(out);
}

RendererSettings rendererSettings(int width, int height, const std::string& context, Quality quality) {
  RendererSettings s;
  s.width = width;
  s.height = height;
  s.context = context;
  s.shadows = s.antialias = quality != Quality::draft;
  s.supersample = quality == Quality::best ? 2 : 1;
  return s;
}

float Renderer::aspect() const {
  return float(data_->settings.width) / float(data_->settings.height);
}

std::string Renderer::description() const {
  data_->context->makeCurrent();
  const auto text = [](unsigned name) { return std::string(reinterpret_cast<const char*>(glGetString(name))); };
  return text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

}  // namespace medulla
