#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "haptics/tool_input.h"
#include "physics/dynamics/world.h"

// A scene file as read: plain values with defaults, nothing loaded yet. Paths are already resolved against the scene
// file's folder. `line` is where the element stands, for errors found later.
namespace medulla {

struct SceneBody {
  int line = 0;
  std::string name, modelPath, look;
  Tissue tissue;
  LinkFactors factors;
  SurfaceMode surface = SurfaceMode::full;
  Eigen::Isometry3d worldFromModel = Eigen::Isometry3d::Identity();
  std::vector<FixedSphere> fixed;
};

// Scenery: drawn, not simulated, not touched yet.
struct SceneStatic {
  int line = 0;
  std::string meshPath, look;
  Eigen::Isometry3d worldFromMesh = Eigen::Isometry3d::Identity();
};

struct SceneTool {
  int line = 0;
  std::string name, trajectoryPath;
  ToolSettings settings;
};

struct CameraKey {
  double time = 0;  // s
  Eigen::Vector3d position{0, 0, 1}, target{0, 0, 0};
  double fovDegrees = 60;
};

struct Scene {
  std::string path, name;
  double servoRate = 1200, dynamicsRate = 50;  // Hz; the first a multiple of the second
  double duration = 1;                         // s
  Eigen::Vector3d gravity{0, -9.81, 0};
  std::vector<SceneBody> bodies;
  std::vector<SceneStatic> statics;
  std::vector<SceneTool> tools;
  std::vector<CameraKey> camera;  // at least one, increasing time
  double lightIntensity = 1;
  Eigen::Vector3d lightOffset{0.012, 0.012, 0};  // m, in the camera's frame
  int width = 1280, height = 720;
  double fps = 30;
  std::vector<double> goldenTimes;  // s
};

// `--set PATH=VALUE`: replaces one attribute before the scene is interpreted, e.g. body.gallbladder.surface=skin,
// dynamics.gravity="0 0 0". Later ones win.
struct SceneOverride {
  std::string path, value;
};

// Throws std::runtime_error "FILE:LINE: what is wrong, what was expected".
Scene readScene(const std::string& path, const std::vector<SceneOverride>& overrides = {});

}  // namespace medulla
