#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "app/enum_names.h"
#include "app/files/mesh_file.h"
#include "app/files/placement.h"
#include "app/files/scene_overrides.h"
#include "app/files/scene_rules.h"
#include "app/files/text.h"
#include "app/files/xml_element.h"
#include "app/scene.h"
#include "physics/content_hash.h"
#include "physics/model/rotation_between.h"
#include "render/glyphs.h"
#include "render/renderer.h"

namespace medulla {

namespace {

template <typename E>
E readEnum(const XmlElement& element, const std::string& attribute, E fallback) {
  const auto names = namesOf(fallback);
  return static_cast<E>(readChoice(element, attribute, {names.begin(), names.end()}, static_cast<int>(fallback)));
}

bool readBool(const XmlElement& element, const std::string& attribute, bool fallback) {
  const std::string text = readText(element, attribute, fallback ? "true" : "false");
  if (text != "true" && text != "false") refuse(element, attribute, "expected true or false");
  return text == "true";
}

// Names stand in override paths, column names, object names and file names.
std::string readName(const XmlElement& element) {
  std::string name = readText(element, "name");
  if (name != plainName(name)) refuse(element, "name", "expected letters, digits, _ and - only");
  if (name.size() > kLongestName) refuse(element, "name", fmt::format("expected at most {} letters", kLongestName));
  return name;
}

std::string readUniqueName(const XmlElement& element, std::set<std::string>& taken) {
  std::string name = readName(element);
  if (!taken.insert(name).second) refuse(element, "name", "another <" + element.name + "> has this name");
  return name;
}

// Of attributes that do not go together, at least one of which is there: what the command line put there, else the
// first.
std::string culprit(const XmlElement& e, std::initializer_list<const char*> attributes) {
  std::string first;
  for (const char* name : attributes) {
    const XmlAttribute* a = e.find(name);
    if (a != nullptr && a->where.starts_with("--set")) return name;
    if (a != nullptr && first.empty()) first = name;
  }
  return first;
}

void readClock(const XmlElement& clock, Scene& scene) {
  scene.duration = readNumber(clock, "duration", scene.duration, {0, 86400, true, false});
  scene.dynamicsRate = readNumber(clock, "dynamics", scene.dynamicsRate, {20, 1200});
  const double settle = readNumber(clock, "settle", 0, {0, 60});  // s
  scene.dynamics.frameDuration = 1 / scene.dynamicsRate;
  scene.dynamics.settleFrames = static_cast<int>(std::ceil(settle * scene.dynamicsRate - 1e-9));
  scene.servoRate = readNumber(clock, "servo", scene.servoRate, {20, 20000});
  const double ratio = scene.servoRate / scene.dynamicsRate;
  if (ratio < 1 || std::abs(ratio - std::round(ratio)) > 1e-9 * ratio) {
    refuse(clock, culprit(clock, {"servo", "dynamics"}),
           "expected the servo rate to be a multiple of the dynamics rate");
  }
}

void readDynamics(const XmlElement& dynamics, WorldSettings& out) {
  out.integrator = readEnum(dynamics, "integrator", out.integrator);
  out.order = 1 + readChoice(dynamics, "order", {"1", "2"}, 0);
  if (out.order == 2 && out.integrator != Integrator::implicit)
    refuse(dynamics, culprit(dynamics, {"order", "integrator"}), "order=\"2\" needs integrator=\"implicit\"");
  out.gravity = readVector(dynamics, "gravity", out.gravity, kAnyForce);
  out.ambientDrag = readNumber(dynamics, "ambient_drag", out.ambientDrag, kNotNegative);
  out.sleepAfter = readNumber(dynamics, "sleep_after", out.sleepAfter, kNotNegative);
  out.substeps = readInteger(dynamics, "substeps", out.substeps, {0, kMostSubsteps});
  out.contact = readEnum(dynamics, "contact", out.contact);
}

constexpr Range kDensity{1e-6};  // kg/m3: air has 1.2, and masses that vanish divide by zero

struct NamedTissue {
  std::string name;
  Tissue tissue;
  ElementPlace place;
};

std::vector<NamedTissue> readTissues(const XmlElement& root) {
  std::vector<NamedTissue> out;
  std::set<std::string> taken;
  for (const XmlElement* e : childrenOf(root, "tissue")) {
    Tissue t;
    t.young = readNumber(*e, "young", t.young, kPositive);
    t.poisson = readNumber(*e, "poisson", t.poisson, {0, 0.5, false, true});
    t.density = readNumber(*e, "density", t.density, kDensity);
    t.damping = readNumber(*e, "damping", t.damping, kNotNegative);
    t.friction = readNumber(*e, "friction", t.friction, kNotNegative);
    out.push_back({readUniqueName(*e, taken), t, e->place});
  }
  return out;
}

const NamedTissue& findTissue(const XmlElement& body, const std::vector<NamedTissue>& tissues) {
  const std::string name = readText(body, "tissue");
  std::vector<std::string> known;
  for (const NamedTissue& t : tissues) {
    if (t.name == name) return t;
    known.push_back(t.name);
  }
  refuse(body, "tissue", "no <tissue> of this name; " + hintOfNames(name, known));
}

Region readRegion(const XmlElement& e) {
  for (const RegionForm& form : kRegionForms) {
    const std::vector<double> numbers = readNumbers(e, form.word, form.count);
    if (numbers.empty()) continue;
    const std::optional<Region> region = makeRegion(form.shape, numbers);
    if (!region) refuse(e, form.word, fmt::format("expected {}: {}", form.rule, form.numbers));
    return *region;
  }
  return {};
}

// The surface nodes that an element means; exactly one attribute says so, or one of `others`, which mean something
// else.
NodeChoice readNodeChoice(const XmlElement& e, const std::vector<std::string>& others, const std::string& scenePath) {
  std::vector<std::string> ways = others;
  for (const RegionForm& form : kRegionForms) ways.push_back(form.word);
  ways.push_back("vertices");
  const auto given = [&](const std::string& way) { return e.find(way) != nullptr; };
  if (std::count_if(ways.begin(), ways.end(), given) != 1)
    throw std::runtime_error(
        fmt::format("{}: <{}> says where by one attribute of {}", e.where, e.name, joined(ways, ", ")));
  NodeChoice choice;
  choice.region = readRegion(e);
  if (e.find("vertices")) choice.verticesPath = readPath(e, "vertices", scenePath);
  return choice;
}

void readFixations(const XmlElement& body, const std::string& scenePath, SceneBody& out) {
  std::set<int> taken;
  for (const XmlElement* fix : childrenOf(body, "fix")) {
    const FixedFreedom freedom = readEnum(*fix, "dof", FixedFreedom::all);
    const NodeChoice nodes = readNodeChoice(*fix, {"spheres"}, scenePath);
    if (!fix->find("spheres")) {
      out.fixes.push_back({fix->place, nodes, freedom});
      continue;
    }
    for (const int sphere : readIntegers(*fix, "spheres", 0, kNotNegative)) {
      if (!taken.insert(sphere).second) refuse(*fix, "spheres", "sphere " + std::to_string(sphere) + " is fixed twice");
      out.fixed.push_back({sphere, freedom});
      out.fixedAt.push_back(fix->place);
    }
  }
}

std::vector<SceneLoad> readLoads(const XmlElement& body, const std::string& scenePath) {
  std::vector<SceneLoad> out;
  for (const XmlElement* e : childrenOf(body, "load")) {
    SceneLoad load;
    load.place = e->place;
    load.nodes = readNodeChoice(*e, {"file"}, scenePath);
    const bool fromFile = e->find("file") != nullptr;
    if (fromFile) load.forcesPath = readPath(*e, "file", scenePath);
    if (fromFile && e->find("force")) refuse(*e, "force", "the file has the forces, expected one of the two");
    if (!fromFile && !e->find("force")) refuse(*e, "force", "expected the attribute \"force\"");
    load.whole.force = readVector(*e, "force", load.whole.force, kAnyForce);
    load.whole.from = readNumber(*e, "from", load.whole.from, kNotNegative);
    load.whole.to = readNumber(*e, "to", load.whole.to, kNotNegative);
    if (load.whole.to < load.whole.from)
      refuse(*e, culprit(*e, {"to", "from"}),
             fmt::format("the load grows from {} s to {} s, expected the earlier time first", load.whole.from,
                         load.whole.to));
    out.push_back(std::move(load));
  }
  return out;
}

void readDrivenSpheres(const XmlElement& body, SceneBody& out) {
  constexpr double kMostOfSwing = 1e6;  // Hz, rad: of larger ones rounding leaves no angle
  for (const XmlElement* drive : childrenOf(body, "drive")) {
    DrivenSphere d;
    d.sphere = readInteger(*drive, "sphere", d.sphere, kNotNegative);
    const auto isThis = [&](const auto& other) { return other.sphere == d.sphere; };
    if (std::any_of(out.fixed.begin(), out.fixed.end(), isThis)) refuse(*drive, "sphere", "this sphere is fixed");
    if (std::any_of(out.driven.begin(), out.driven.end(), isThis))
      refuse(*drive, "sphere", "this sphere is driven twice");
    d.axis = readVector(*drive, "axis", d.axis);
    if (!(d.axis.norm() > 0)) refuse(*drive, "axis", "expected a direction");  // nor one whose squares vanish
    d.amplitude = readNumber(*drive, "amplitude", d.amplitude, {.low = 0, .most = kAnyLength.most});
    d.frequency = readNumber(*drive, "frequency", d.frequency, {.low = 0, .lowExcluded = true, .most = kMostOfSwing});
    d.phase = readNumber(*drive, "phase", d.phase, {.most = kMostOfSwing});
    d.velocity = readVector(*drive, "velocity", d.velocity);
    d.freedom = readEnum(*drive, "dof", d.freedom);
    out.driven.push_back(d);
    out.drivenAt.push_back(drive->place);
  }
}

void readSteeredLinks(const XmlElement& body, SceneBody& out) {
  for (const XmlElement* e : childrenOf(body, "links")) {
    SteeredLinks links;
    if (e->find("select") && readText(*e, "select") != "all")
      refuse(*e, "select", "expected all, or box, sphere or plane instead");
    const auto given = [&](const RegionForm& form) { return e->find(form.word) != nullptr; };
    const auto regions = std::count_if(kRegionForms.begin(), kRegionForms.end(), given);
    if (regions + (e->find("select") != nullptr) > 1)
      throw std::runtime_error(e->where + ": <links> says which by one attribute of select, box, sphere, plane");
    if (regions > 0) links.where = readRegion(*e);
    links.factors.elongation = readNumber(*e, "elongation", links.factors.elongation, kPositive);
    links.factors.flexion = readNumber(*e, "flexion", links.factors.flexion, kPositive);
    links.factors.torsion = readNumber(*e, "torsion", links.factors.torsion, kPositive);
    out.steered.push_back(links);
    out.steeredAt.push_back(e->place);
  }
}

// Names may stand before the body that bears them: read when all bodies are.
void readNeighbours(const XmlElement& root, Scene& scene) {
  std::vector<std::string> known;
  for (const SceneBody& body : scene.bodies) known.push_back(body.name);
  const std::vector<const XmlElement*> bodies = childrenOf(root, "body");
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    for (const XmlElement* e : childrenOf(*bodies[b], "neighbours")) {
      std::vector<int>& out = scene.bodies[b].neighbours.emplace();
      const std::vector<std::string> names = readWords(*e, "names");
      if (names.empty()) refuse(*e, "names", "expected names of bodies");
      for (const std::string& name : names) {
        const auto found = std::find(known.begin(), known.end(), name);
        if (found == known.end())
          refuse(*e, "names", fmt::format("no <body> is named {}; {}", inQuotes(name, '"'), hintOfNames(name, known)));
        if (name == known[b]) refuse(*e, "names", "a body is no neighbour of itself");
        out.push_back(static_cast<int>(found - known.begin()));
      }
    }
  }
}

void readBodies(const XmlElement& root, Scene& scene) {
  const std::vector<NamedTissue> tissues = readTissues(root);
  std::set<std::string> taken;
  for (const XmlElement* e : childrenOf(root, "body")) {
    SceneBody body;
    body.place = e->place;
    body.name = readUniqueName(*e, taken);
    body.modelPath = readPath(*e, "model", scene.path);
    body.look = readText(*e, "look");
    const NamedTissue& tissue = findTissue(*e, tissues);
    body.tissue = tissue.tissue;
    body.tissuePlace = tissue.place;
    body.links = readEnum(*e, "links", body.links);
    body.choosesLinks = e->find("links") != nullptr;
    body.surface = readEnum(*e, "surface", body.surface);
    body.worldFromModel = readPlacement(*e);
    if (e->find("reference")) body.referencePath = readPath(*e, "reference", scene.path);
    readFixations(*e, scene.path, body);
    body.loads = readLoads(*e, scene.path);
    readDrivenSpheres(*e, body);
    readSteeredLinks(*e, body);
    scene.bodies.push_back(std::move(body));
  }
  readNeighbours(root, scene);
}

// An attribute that one shape alone has: refused on the others, asked for on its own if `needed`.
void requireShape(const XmlElement& e, const std::string& attribute, bool fits, bool needed, const std::string& shape) {
  const bool present = e.find(attribute) != nullptr;
  if (present && !fits) refuse(e, attribute, fmt::format("only shape=\"{}\" has this attribute", shape));
  if (!present && needed) refuse(e, "shape", fmt::format("expected the attribute \"{}\" with this shape", attribute));
}

void readShape(const XmlElement& e, StaticShape& shape) {
  using Kind = StaticShape::Kind;
  shape.kind = readEnum(e, "shape", shape.kind);
  const bool plane = shape.kind == Kind::plane, box = shape.kind == Kind::box, sphere = shape.kind == Kind::sphere,
             mesh = shape.kind == Kind::mesh;
  requireShape(e, "normal", plane, plane, "plane");
  requireShape(e, "size", box, box, "box");
  requireShape(e, "radius", sphere, sphere, "sphere");
  requireShape(e, "mesh", mesh, mesh, "mesh");
  requireShape(e, "unit", mesh, false, "mesh");
  if (plane && e.find("orientation")) refuse(e, "orientation", "a plane has a normal instead");
  shape.worldFromShape = readPlacement(e);
  if (plane) {
    const Eigen::Vector3d normal = readVector(e, "normal", Eigen::Vector3d::UnitY());
    if (!(normal.norm() > 0)) refuse(e, "normal", "expected a direction");
    shape.worldFromShape.linear() = rotationBetween(Eigen::Vector3d::UnitY(), normal).toRotationMatrix();
  }
  const std::vector<double> size = readNumbers(e, "size", 3, kAnyLength);
  if (box) shape.size = {size[0], size[1], size[2]};
  shape.radius = readNumber(e, "radius", shape.radius, kAnyLength);
  shape.friction = readNumber(e, "friction", shape.friction, kNotNegative);
}

void readStatics(const XmlElement& root, Scene& scene) {
  for (const XmlElement* e : childrenOf(root, "static")) {
    SceneStatic out;
    out.place = e->place;
    readShape(*e, out.shape);
    const bool mesh = out.shape.kind == StaticShape::Kind::mesh;
    if (mesh) out.meshPath = readPath(*e, "mesh", scene.path);
    out.contact = readBool(*e, "contact", !mesh);
    out.look = readText(*e, "look");
    if (out.look.empty() && !out.contact) refuse(*e, "shape", "without contact and without a look it has no effect");
    if (!out.contact && e->find("friction"))
      refuse(*e, culprit(*e, {"friction", "contact"}), "friction needs contact=\"true\"");
    out.unit = lengthUnits()[readChoice(*e, "unit", lengthUnits(), 0)];
    scene.statics.push_back(std::move(out));
  }
}

void readTools(const XmlElement& root, Scene& scene) {
  constexpr Range toolLength{.low = 0, .lowExcluded = true, .most = kToolReach / 4};  // queries go little beyond a tool
  std::set<std::string> taken;
  for (const XmlElement* e : childrenOf(root, "tool")) {
    SceneTool tool;
    ToolSettings& s = tool.settings;
    tool.place = e->place;
    tool.name = readUniqueName(*e, taken);
    if (std::any_of(scene.bodies.begin(), scene.bodies.end(), [&](const SceneBody& b) { return b.name == tool.name; }))
      refuse(*e, "name", "a <body> has this name, and columns of logs are named after both");
    tool.trajectoryPath = readPath(*e, "trajectory", scene.path);
    s.radius = readNumber(*e, "radius", s.radius, toolLength);
    s.stiffness = readNumber(*e, "stiffness", s.stiffness, kPositive);
    s.damping = readNumber(*e, "damping", s.damping, kNotNegative);
    s.forceMax = readNumber(*e, "force_max", s.forceMax, kPositive);
    s.gripRadius = readNumber(*e, "grip_radius", s.gripRadius, toolLength);
    s.gripForceMax = readNumber(*e, "grip_force_max", s.gripForceMax, kPositive);
    const std::vector<double> friction = readNumbers(*e, "friction", 2, kNotNegative);
    if (!friction.empty()) {
      if (friction[0] < friction[1]) refuse(*e, "friction", "expected static >= dynamic friction");
      s.staticFriction = friction[0];
      s.dynamicFriction = friction[1];
    }
    scene.tools.push_back(std::move(tool));
  }
}

// A key says what changes; what it leaves out is the camera's own.
CameraKey readCameraKey(const XmlElement& e, CameraKey key) {
  key.line = e.place.line;
  key.time = readNumber(e, "t", 0, kNotNegative);
  key.position = readVector(e, "position", key.position, kAnyPlace);
  key.target = readVector(e, "target", key.target, kAnyPlace);
  key.fovDegrees = readNumber(e, "fov", key.fovDegrees, {0.01, 180, false, true});
  if (key.position == key.target) refuse(e, "position", "position and target are the same point");
  return key;
}

void readCamera(const XmlElement& camera, Scene& scene) {
  const CameraKey own = readCameraKey(camera, {});
  for (const XmlElement* e : childrenOf(camera, "key")) {
    const CameraKey key = readCameraKey(*e, own);
    if (scene.camera.empty() && key.time > 0) scene.camera.push_back(own);
    if (!scene.camera.empty() && key.time <= scene.camera.back().time)
      refuse(*e, "t", "expected a later time than the key before it");
    scene.camera.push_back(key);
  }
  if (scene.camera.empty()) scene.camera.push_back(own);
  scene.endoscope = readBool(camera, "endoscope", scene.endoscope);
}

void readLight(const XmlElement& light, Scene& scene) {
  scene.lightOffset = readVector(light, "offset", scene.lightOffset, kAnyPlace);
  scene.lightIntensity = readNumber(light, "intensity", scene.lightIntensity, kNotNegative);
  if (light.find("position")) scene.lightPosition = readVector(light, "position", Eigen::Vector3d::Zero(), kAnyPlace);
  const CameraKey& first = scene.camera.front();
  const double away = (first.target - scene.lightPosition.value_or(first.position)).norm();
  scene.lightReferenceDistance =
      readNumber(light, "reference_distance", away > 0 ? away : scene.lightReferenceDistance, kAnyLength);
  if (scene.lightPosition && light.find("offset"))
    refuse(light, culprit(light, {"offset", "position"}),
           "expected one of offset, from the lens, and position, in the world");
  const std::vector<double> haze = readNumbers(light, "haze", 3, kNotNegative);
  if (!haze.empty()) scene.haze = Eigen::Vector3d(haze[0], haze[1], haze[2]);
  scene.hazeDistance = readNumber(light, "haze_distance", scene.hazeDistance, kAnyLength);
  if (!scene.haze && light.find("haze_distance")) refuse(light, "haze_distance", "expected a haze beside it");
  scene.caustics = readNumber(light, "caustics", scene.caustics, {0, 1});
  if (!scene.lightPosition && scene.caustics > 0) refuse(light, "caustics", "expected a light with a position");
}

void readCaptions(const XmlElement& output, Scene& scene) {
  for (const XmlElement* e : childrenOf(output, "caption")) {
    SceneCaption caption{readNumber(*e, "from", 0, kNotNegative), readNumber(*e, "to", 0, kNotNegative),
                         readText(*e, "text")};
    if (caption.text.empty()) refuse(*e, "text", "expected words");
    if (const std::string_view undrawn = firstUndrawn(caption.text); !undrawn.empty())
      refuse(*e, "text", "expected Latin letters, digits and signs, not " + inQuotes(undrawn));
    if (caption.to <= caption.from) refuse(*e, "to", "expected a later time than from");
    if (!scene.captions.empty() && caption.from < scene.captions.back().to)
      refuse(*e, "from", "expected no earlier time than the end of the caption before it");
    scene.captions.push_back(std::move(caption));
  }
}

void readOutput(const XmlElement& output, Scene& scene) {
  const std::vector<int> size = readIntegers(output, "size", 2, {kPictureSideMin, kPictureSideMax});
  if (!size.empty()) {
    if (size[0] % 2 != 0 || size[1] % 2 != 0)
      refuse(output, "size", "expected even width and height (video needs them)");
    scene.width = size[0];
    scene.height = size[1];
  }
  scene.fps = readNumber(output, "fps", scene.fps, {1, 240});
  scene.goldenTimes = readNumbers(output, "golden", 0, kNotNegative);
  for (std::size_t k = 1; k < scene.goldenTimes.size(); ++k)
    if (scene.goldenTimes[k] <= scene.goldenTimes[k - 1]) refuse(output, "golden", "expected increasing times");
  // A run cut short from the command line is still a run; a scene file that contradicts itself is a mistake.
  if (durationOverridden(scene)) std::erase_if(scene.goldenTimes, [&](double t) { return t > scene.duration; });
  if (!scene.goldenTimes.empty() && scene.goldenTimes.back() > scene.duration)
    refuse(output, "golden", "a time beyond the scene's duration");
  const std::vector<int> pictures = goldenPictures(scene);
  const auto twice = std::adjacent_find(pictures.begin(), pictures.end());
  if (twice != pictures.end() && !durationOverridden(scene) &&
      (!isOverridden(scene, "output.fps") || isOverridden(scene, "output.golden")))
    refuse(output, "golden", fmt::format("two golden moments are picture {} at {:.6g} Hz", *twice, scene.fps));
  readCaptions(output, scene);
}

// An element that says nothing is as good as none: overrides leave such behind, and attributes in another order.
bool saysSomething(const XmlElement& e) {
  return !e.attributes.empty() || !e.children.empty() || !e.text.empty();
}

// Each name, value and text ends in a zero, each element in two: so no two trees have the same bytes.
std::uint64_t hashOf(const XmlElement& e, bool motionOnly, std::uint64_t hash) {
  const auto add = [&hash](const std::string& word) {
    hash = contentHash(std::string_view("\0", 1), contentHash(word, hash));
  };
  add(e.name);
  std::vector<XmlAttribute> attributes = e.attributes;
  std::sort(attributes.begin(), attributes.end(),
            [](const XmlAttribute& a, const XmlAttribute& b) { return a.name < b.name; });
  for (const XmlAttribute& a : attributes) {
    if (motionOnly && a.name == "look") continue;
    add(a.name);
    add(a.value);
  }
  add(e.text);
  for (const XmlElement& child : e.children) {
    const bool drawing = child.name == "camera" || child.name == "light" || child.name == "output";
    if (saysSomething(child) && !(motionOnly && drawing)) hash = hashOf(child, motionOnly, hash);
  }
  return contentHash(std::string_view("\0", 1), hash);
}

}  // namespace

bool isOverridden(const Scene& scene, std::string_view path) {
  return std::any_of(scene.overridden.begin(), scene.overridden.end(),
                     [path](const OverriddenAttribute& o) { return o.path == path; });
}

bool durationOverridden(const Scene& scene) {
  return isOverridden(scene, "clock.duration");
}

int pictureCount(const Scene& scene) {
  return std::max(1, static_cast<int>(std::ceil(scene.duration * scene.fps - 1e-9)));
}

std::vector<int> goldenPictures(const Scene& scene) {
  std::vector<int> pictures;
  for (const double time : scene.goldenTimes)
    pictures.push_back(std::min(static_cast<int>(std::lround(time * scene.fps)), pictureCount(scene) - 1));
  return pictures;
}

Scene readScene(const std::string& path, const std::vector<SceneOverride>& overrides) {
  Scene scene;
  const XmlElement root = readXml(
      path, sceneRules(), [&](XmlElement& editable) { scene.overridden = applyOverrides(editable, overrides); });
  scene.path = path;
  scene.name = readName(root);
  readClock(onlyChild(root, "clock"), scene);
  readDynamics(onlyChild(root, "dynamics"), scene.dynamics);
  readBodies(root, scene);
  readStatics(root, scene);
  readTools(root, scene);
  readCamera(onlyChild(root, "camera"), scene);
  readLight(onlyChild(root, "light"), scene);
  readOutput(onlyChild(root, "output"), scene);
  scene.contentHash = hashOf(root, false, contentHash({}));
  scene.motionHash = hashOf(root, true, contentHash({}));
  return scene;
}

}  // namespace medulla
