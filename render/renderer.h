#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/image.h"
#include "render/stage_times.h"

// Draws one picture from plain arrays. Knows looks, light and pixels; knows nothing of bodies and physics.
namespace medulla {

// Of those that fill a body, as its surfaces' neighbours feel its nearness: they are darker beside it.
struct ShadeBall {
  glm::vec3 centre{0};  // m, world
  float radius = 0;     // m
};

// A surface as it is at rest; given once. Textures, colour variation and ambient occlusion are baked from it.
struct SurfaceShape {
  std::string look;                                     // a name of lookNames()
  std::vector<glm::vec3> restPositions;                 // m, world at the start of the run
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise from outside
  bool travels = false;              // leaves the place that it has at rest: ambient occlusion is its own alone
  std::vector<ShadeBall> restBalls;  // none: it shades only what is baked
};

// The same surface in one picture. Static surfaces leave `positions` empty and are drawn as at rest.
struct SurfaceState {
  std::vector<glm::vec3> positions;  // m, world
  std::vector<ShadeBall> balls;      // as at rest, where they are now
};

struct Camera {
  glm::vec3 position{0, 0, 1}, target{0, 0, 0}, up{0, 1, 0};
  float fovDegrees = 60;  // vertical
};

// Cameras of scenes are set up for 16:9. A much narrower picture, a half of a split one or one held upright, is to show
// three quarters of that from side to side: so much more from top to bottom, and the endoscope's round picture is so
// much smaller.
float widening(float aspect);

// Light scattered by air or water: it fills the background, reaches what the lamp does not, and veils what is far away:
// a surface at distance d keeps exp(-d / distance) of its own light.
struct Haze {
  glm::vec3 colour{0};  // linear RGB towards the horizon; brighter above it, darker below (+y is up)
  float distance = 10;  // m
};

// The endoscope's light sits beside the lens; offset in the camera's frame (right, up, back), m. A matt surface of
// albedo a that faces it at distance d has the radiance 1.3 a intensity 1.14 r^2 / (d^2 + 0.14 r^2), r =
// referenceDistance, shown through the ACES tone curve and the sRGB transfer. Setting referenceDistance to the distance
// of what matters does what a camera's automatic exposure does; the veil of distance (round pictures only) is measured
// in it too.
struct Light {
  glm::vec3 offset{0.012f, 0.012f, 0};
  std::optional<glm::vec3> position;  // m, world: the lamp hangs here instead, and shines to all sides
  float intensity = 1;                // 1 exposes a surface at `referenceDistance` fully
  float referenceDistance = 0.15f;
  std::optional<Haze> haze;  // none: the dim red of a body's cavity
  float caustics = 0;        // 0..1, with a position: contrast of ripples, as under a moving water surface
};

struct Instrument {
  glm::vec3 tip{0};
  glm::quat worldFromTool{1, 0, 0, 0};  // shaft along +z away from the tip, jaws open in its yz plane
  float jawAngle = 0.3f;                // rad, of each jaw from the axis
  float scale = 1;                      // of one whose shaft is 5 mm across
  bool touching = false;                // tissue blanches around the tip
  glm::vec3 press{0};                   // m: what it gives way by under the tip, which is drawn so much deeper
  float hold = 0;                       // 0..1: by how much it rises between the jaws instead
  float grasp = 0;                      // 0..1: how far the tool holds, open or not: what it holds loses its blood
};

struct DrawnBall {  // not Ball: the model has one of its own
  glm::vec3 centre{0};
  float radius = 0;
  glm::vec4 colour{1};  // linear RGB, alpha < 1 is seen through
};
struct Segment {
  glm::vec3 a{0}, b{0};
  float radius = 0.0005f;  // m
  glm::vec4 colour{1};
};

struct Arrow {
  glm::vec3 from{0}, to{0};
  float radius = 0.001f;  // m, of the shaft; the head is thrice as wide
  glm::vec4 colour{1};    // linear RGB
};

// Shapes in colours of their own, lit as in a studio. None is drawn thinner than a pixel and a fifth; segments of the
// model that are much thinner are fainter instead.
struct Drawing {
  std::vector<DrawnBall> balls;
  std::vector<Segment> segments;
  std::vector<Arrow> arrows;

  bool empty() const { return balls.empty() && segments.empty() && arrows.empty(); }
  void clear() {
    balls.clear();
    segments.clear();
    arrows.clear();
  }
};

// tissue: skins. model: the model and instruments before a light backdrop, never round. both: surfaces that have
// positions in this picture are seen through over the model, the others stay opaque.
enum class ViewKind { tissue, model, both };

struct Picture {
  float time = 0;  // s: moves what moves by itself, the ripples of light
  ViewKind view = ViewKind::tissue;
  Camera camera;
  Light light;
  bool endoscopeMask = true;           // round picture with a soft rim
  std::vector<SurfaceState> surfaces;  // index: order of addSurface
  std::vector<Instrument> instruments;
  Drawing model;    // after the paper's figures; hidden behind skins
  Drawing overlay;  // over everything else: something said about the picture rather than in it
};

constexpr int kPictureSideMin = 16, kPictureSideMax = 8192;  // px

struct RendererSettings {
  int width = 1280, height = 720;  // kPictureSideMin..kPictureSideMax
  std::string context = "auto";    // auto | osmesa | egl
  bool shadows = true, antialias = true;
  int supersample = 1;  // 1 to 4: every pixel is the mean, in light, of its square
};

// draft: no shadows, jagged edges. standard. best: four times the pixels, then averaged.
enum class Quality { draft, standard, best };
RendererSettings rendererSettings(int width, int height, const std::string& context, Quality quality);

class Renderer {
 public:
  explicit Renderer(const RendererSettings& settings);  // throws std::runtime_error when no context can be made
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  void addSurface(SurfaceShape shape);  // throws std::runtime_error on an unknown look, naming the known ones
  void render(const Picture& picture, Image& out);
  // The same in two steps: OpenGL's threads fill one picture while the next is placed and lit. begin() may be one
  // picture ahead of take(), which gives the pictures in their order. Both add to `times`, if given.
  void begin(const Picture& picture, StageTimes* times = nullptr);
  void take(Image& out, StageTimes* times = nullptr);
  float aspect() const;             // width over height
  std::string description() const;  // GL_RENDERER and GL_VERSION: golden images record it

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

std::vector<std::string> lookNames();

}  // namespace medulla
