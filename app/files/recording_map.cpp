#include "app/files/recording_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/files/mesh_file.h"
#include "app/files/placement.h"

namespace medulla {

namespace {

ColumnChoice numbersFrom(int first, int count) {
  ColumnChoice out;
  for (int k = 0; k < count; ++k) out.push_back(std::to_string(first + k));
  return out;
}

ColumnChoice under(const std::string& prefix, std::vector<std::string> names) {
  for (std::string& name : names) name.insert(0, prefix);
  return names;
}

// Kinematics of the JHU-ISI Gesture and Skill Assessment Working Set (Gao and others 2014): per arm 19 columns,
// position, rotation row-major, two velocities, gripper angle; no time, 30 Hz.
void useJigsaws(int arm, RecordingMap& map) {
  const int before = 19 * arm;
  RecordingColumns columns;
  columns.rate = 30;
  columns.position = numbersFrom(before + 1, 3);
  columns.matrix = numbersFrom(before + 4, 9);
  columns.grip = {std::to_string(before + 19)};
  columns.count = 76;
  map.layouts = {columns};
  map.gripOpen = 1;
  map.gripCloses = 0.2;  // rad
  map.hasOwnGrip = true;
}

// geometry_msgs/PoseStamped as three programs write it: rostopic echo -p, bagpy, and ros2 topic echo --csv, which has
// no header.
void useRos(RecordingMap& map) {
  const std::vector<std::string> position = {"x", "y", "z"}, quaternion = {"w", "x", "y", "z"};
  RecordingColumns echo, bag, second;
  echo.time = {"field.header.stamp"};
  echo.secondsPerUnit = 1e-9;
  echo.position = under("field.pose.position.", position);
  echo.quaternion = under("field.pose.orientation.", quaternion);
  bag.time = {"header.stamp.secs", "header.stamp.nsecs"};
  bag.position = under("pose.position.", position);
  bag.quaternion = under("pose.orientation.", quaternion);
  second.time = {"1", "2"};
  second.position = numbersFrom(4, 3);
  second.quaternion = {"10", "7", "8", "9"};
  second.count = 10;
  map.layouts = {echo, bag, second};
}

void useMap(const XmlElement& root, RecordingMap& map) {
  enum { table, jigsaws, ros, sofa };
  const int name = readChoice(root, "map", {"table", "jigsaws", "ros", "sofa"}, table);
  const std::string parts = "part=\"master_left|master_right|slave_left|slave_right\"";
  if (name == jigsaws && !root.find("part")) refuse(root, "map", parts + " is missing, which says whose motion it is");
  if (name != jigsaws && root.find("part")) refuse(root, "part", parts + " belongs to map=\"jigsaws\"");
  map.layouts.resize(1);
  map.writeState = name == sofa;
  if (name == ros) useRos(map);
  if (name == jigsaws)
    useJigsaws(readChoice(root, "part", {"master_left", "master_right", "slave_left", "slave_right"}, 0), map);
}

// True where the attribute is there.
bool readColumns(const XmlElement& e, const std::string& attribute, std::vector<std::size_t> counts,
                 ColumnChoice& out) {
  if (!e.find(attribute)) return false;
  out = readWords(e, attribute);
  if (std::find(counts.begin(), counts.end(), out.size()) != counts.end()) return true;
  refuse(e, attribute, fmt::format("{} columns, expected {}", out.size(), counts[0]));
}

void readLayout(const XmlElement& e, RecordingColumns& columns) {
  if (e.find("time") && e.find("rate")) refuse(e, "rate", "expected either a time column or a rate");
  if (readColumns(e, "time", {1, 2}, columns.time)) columns.rate = 0;
  columns.rate = readNumber(e, "rate", columns.rate, kPositive);
  if (e.find("rate")) columns.time.clear();
  readColumns(e, "position", {3}, columns.position);
  if (e.find("quaternion") && e.find("matrix")) refuse(e, "matrix", "expected either a quaternion or a matrix");
  if (readColumns(e, "quaternion", {4}, columns.quaternion)) columns.matrix.clear();
  if (readColumns(e, "matrix", {9}, columns.matrix)) columns.quaternion.clear();
  readColumns(e, "grip", {1}, columns.grip);
  readColumns(e, "force", {3}, columns.force);
}

void readUnits(const XmlElement& e, RecordingMap& map) {
  const std::vector<std::string> times = {"s", "ms", "us", "ns"};
  constexpr double seconds[] = {1, 1e-3, 1e-6, 1e-9};
  map.metresPerUnit = metresPerUnit(lengthUnits()[readChoice(e, "length", lengthUnits(), 0)]);
  if (!e.find("time")) return;
  for (RecordingColumns& columns : map.layouts) columns.secondsPerUnit = seconds[readChoice(e, "time", times, 0)];
}

void readGrip(const XmlElement& e, RecordingMap& map) {
  map.gripOpen = readNumber(e, "open", map.gripOpen);
  map.gripCloses = readNumber(e, "closes", map.gripCloses);
  map.hasOwnGrip = map.hasOwnGrip || !e.where.empty();
  if (map.gripOpen == map.gripCloses) refuse(e, "closes", "the grip is open there, expected another value");
}

void readFrame(const XmlElement& e, RecordingMap& map) {
  if (e.find("mirror")) map.mirror[readChoice(e, "mirror", {"x", "y", "z"}, 0)] = -1;
  map.scale = readNumber(e, "scale", map.scale, kPositive);
  map.worldFromRecording = readPlacement(e);
  map.deviceFromTool = readOrientation(e, "tool");
}

void readSpan(const XmlElement& e, RecordingMap& map) {
  map.from = readNumber(e, "from", map.from, kNotNegative);
  map.to = readNumber(e, "to", map.to, kNotNegative);
  if (!(map.to > map.from)) refuse(e, e.find("to") ? "to" : "from", "expected from < to");
  map.delay = readNumber(e, "delay", map.delay, kNotNegative);
  map.smooth = readNumber(e, "smooth", map.smooth, {0, 1});
}

// What no map has given, and what would have no effect.
void requireComplete(const XmlElement& root, const RecordingMap& map) {
  const RecordingColumns& layout = map.layouts[0];
  const XmlElement &columns = onlyChild(root, "columns"), &grip = onlyChild(root, "grip"),
                   &units = onlyChild(root, "units");
  if (!grip.where.empty() && map.writeState) refuse(grip, "", "map=\"sofa\" has no grip, expected none");
  if (!grip.where.empty() && layout.grip.empty())
    refuse(grip, "", "there is no grip column, expected one in <columns>");
  if (layout.rate > 0 && units.find("time")) refuse(units, "time", "there is a rate, expected no unit of time");
  const auto splitsTime = [](const RecordingColumns& of) { return of.time.size() == 2; };
  if (std::any_of(map.layouts.begin(), map.layouts.end(), splitsTime) && units.find("time"))
    refuse(units, "time", "times are in columns of seconds and nanoseconds, expected no unit of time");
  if (map.writeState && !columns.where.empty()) refuse(columns, "", "map=\"sofa\" is no table, expected none");
  if (map.writeState) return;
  const XmlElement& place = columns.where.empty() ? root : columns;
  if (layout.position.empty()) refuse(place, "position", "expected <columns position=\"x y z\"/>, or a map");
  if (layout.time.empty() && layout.rate == 0)
    refuse(place, "time", "expected <columns time=\"..\"/>, or rate=\"..\" in Hz");
}

}  // namespace

const XmlRules& recordingRules() {
  static const XmlRules rules = {
      {"recording",
       {"file"},
       {"map", "part"},
       {{"columns", 0, 1}, {"units", 0, 1}, {"grip", 0, 1}, {"frame", 0, 1}, {"span", 0, 1}}},
      {"columns", {}, {"time", "rate", "position", "quaternion", "matrix", "grip", "force"}, {}},
      {"units", {}, {"length", "time"}, {}},
      {"grip", {}, {"open", "closes"}, {}},
      {"frame", {}, {"position", "orientation", "mirror", "scale", "tool"}, {}},
      {"span", {}, {"from", "to", "delay", "smooth"}, {}},
  };
  return rules;
}

bool isRecording(const std::string& path) {
  return std::filesystem::path(path).extension() == ".xml";
}

RecordingMap readRecordingMap(const std::string& path) {
  const XmlElement root = readXml(path, recordingRules());
  RecordingMap map;
  map.path = path;
  map.line = root.place.line;
  map.recordingPath = readPath(root, "file", path);
  useMap(root, map);
  for (RecordingColumns& layout : map.layouts) readLayout(onlyChild(root, "columns"), layout);
  readUnits(onlyChild(root, "units"), map);
  readGrip(onlyChild(root, "grip"), map);
  readFrame(onlyChild(root, "frame"), map);
  readSpan(onlyChild(root, "span"), map);
  requireComplete(root, map);
  return map;
}

}  // namespace medulla
