#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/files/input_error.h"
#include "haptics/tool_input.h"
#include "physics/dynamics/region.h"
#include "physics/dynamics/world.h"

// A scene file as read: plain values with defaults, nothing loaded yet. Paths are already resolved against the scene
// file's folder. `place` is the element's, for errors found later.
namespace medulla {

// Surface nodes: those in a part of space, or those that the listed vertices of the mesh file became.
struct NodeChoice {
  Region region;
  std::string verticesPath;  // empty: the region
};

struct SceneFix {
  ElementPlace place;
  NodeChoice nodes;
  FixedFreedom freedom = FixedFreedom::all;  // of the spheres that the fixed nodes hold
};

struct SceneLoad {
  ElementPlace place;
  NodeChoice nodes;
  std::string forcesPath;  // a force per vertex, instead of nodes and force; empty: those
  DeadLoad whole;          // force on all chosen nodes together, N, world; its node is of no account
  bool isIdle = false;     // acts where the body is held alone: found by loadScene()
};

// loadScene() finds the model, fixed nodes and dead loads, and adds to the spheres fixed by number those that fixed
// nodes hold.
struct SceneBody : BodyDescription {
  ElementPlace place, tissuePlace;
  std::string modelPath, look;
  bool choosesLinks = false;  // says which, rather than leaving it to the default
  std::string referencePath;  // where another program puts its vertices at the end; empty: none
  std::vector<SceneFix> fixes;
  std::vector<SceneLoad> loads;
  // Of each sphere fixed by number, each driven one, and each element that steers links.
  std::vector<ElementPlace> fixedAt, drivenAt, steeredAt;
};

// What does not move: drawn if it has a look, holding bodies if it says so.
struct SceneStatic {
  ElementPlace place;
  StaticShape shape;           // without its mesh
  bool contact = false;        // by default meshes are scenery, and simple shapes are there to be lain on
  std::string meshPath, look;  // empty: no mesh, not drawn
  std::string unit = "m";      // of the mesh file; a name that metresPerUnit() knows
};

struct SceneTool {
  ElementPlace place;  // line 0: the command line names its motion
  std::string name, trajectoryPath;
  std::string recordingPath;  // where trajectoryPath describes one: found by loadScene()
  ToolSettings settings;
};

struct CameraKey {
  double time = 0;  // s, >= 0
  Eigen::Vector3d position{0, 0, 1}, target{0, 0, 0};
  double fovDegrees = 60;  // vertical, > 0, < 180
  int line = 0;
};

// What happens, for those who watch.
struct SceneCaption {
  double from = 0, to = 0;  // s, from < to
  std::string text;
};

// What an override put into the place of what the file says, for errors found later.
struct OverriddenAttribute {
  ElementPlace place;  // of its element
  std::string attribute, path;
};

inline constexpr int kMostSubsteps = 100000;  // per dynamics frame, that a scene may ask for

struct Scene {
  std::string path, name;
  double servoRate = 1200, dynamicsRate = 50;  // Hz, up to 20000 and 20 to 1200; the first a multiple of the second
  double duration = 1;                         // s, > 0, <= 86400
  WorldSettings dynamics{.contact = ContactMode::balls};
  std::vector<SceneBody> bodies;
  std::vector<SceneStatic> statics;
  std::vector<SceneTool> tools;
  std::vector<CameraKey> camera;                 // at least one, strictly increasing time, the first at 0
  double lightIntensity = 1;                     // >= 0
  double lightReferenceDistance = 0.15;          // m, > 0; where intensity 1 exposes a surface fully; files say it, or
                                                 // it is to the camera's first target, from the light's position or
                                                 // from the camera
  Eigen::Vector3d lightOffset{0.012, 0.012, 0};  // m, in the camera's frame
  std::optional<Eigen::Vector3d> lightPosition;  // m, world: instead of beside the lens
  std::optional<Eigen::Vector3d> haze;           // linear RGB, >= 0
  double hazeDistance = 10;                      // m, > 0
  double caustics = 0;                           // 0 to 1, with a position
  bool endoscope = true;                         // the picture is round
  int width = 1280, height = 720;                // 16 to 8192, even
  double fps = 30;                               // 1 to 240
  std::vector<double> goldenTimes;               // s, strictly increasing, within 0 to duration, a picture each
  std::vector<SceneCaption> captions;            // in the order of their times, none over another
  // Of what the file and its overrides say, however it is laid out; files that they name are not looked into.
  std::uint64_t contentHash = 0;  // of everything
  std::uint64_t motionHash = 0;   // without camera, light, output and looks: the same motion, however it is drawn
  std::vector<OverriddenAttribute> overridden;
};

// `--set PATH=VALUE`: replaces one attribute before the scene is interpreted, e.g. body.gallbladder.surface=skin,
// dynamics.gravity="0 0 0". PATH is element[.name].attribute, children behind their parent
// (body.gallbladder.links.torsion). Later ones win. An overridden duration drops the golden times beyond it.
struct SceneOverride {
  std::string path, value;
};

// Whether an override has put something there: "output.fps".
bool isOverridden(const Scene& scene, std::string_view path);
// Whether an override says how long the scene is: a run cut short from the command line, say.
bool durationOverridden(const Scene& scene);

// How many pictures a scene has at its own rate, and which of them its golden moments are.
int pictureCount(const Scene& scene);
std::vector<int> goldenPictures(const Scene& scene);

// Throws std::runtime_error "FILE:LINE: what is wrong, what was expected", with "--set PATH" in the place of FILE:LINE
// where an override is at fault. Files that the scene names are not opened.
Scene readScene(const std::string& path, const std::vector<SceneOverride>& overrides = {});

}  // namespace medulla
