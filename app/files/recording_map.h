#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <string>
#include <vector>

#include "app/files/xml_element.h"

// A recording made by another program, described by a small XML file that stands in the place of a trajectory:
//
//   <recording file="needle.txt" map="jigsaws" part="slave_right">
//     <grip open="1" closes="0.2"/> <frame scale="0.5" position="0 0 0.1"/> <span from="2" to="9" smooth="0.05"/>
//   </recording>
//
// A map knows a format; what <columns>, <units> and <grip> say goes before it. scenes/recording.xsd lists every name.
namespace medulla {

// Columns by number from 1, or by name in the file's header.
using ColumnChoice = std::vector<std::string>;

struct RecordingColumns {
  ColumnChoice time;        // one, or whole seconds and nanoseconds; none: by rate
  double rate = 0;          // Hz, > 0 where there is no time
  ColumnChoice position;    // x y z
  ColumnChoice quaternion;  // w x y z; none: by matrix
  ColumnChoice matrix;      // nine, row-major, world from tool; none: the tool does not turn
  ColumnChoice grip;        // one; none: always open
  ColumnChoice force;       // x y z on the hand, N; none: not measured
  int count = 0;            // that a row must have; 0: as many as the first
  double secondsPerUnit = 1;
};

struct RecordingMap {
  std::string path, recordingPath;  // of the XML, and of what it describes
  int line = 0;
  bool writeState = false;                  // SOFA's text of one rigid instead of a table
  std::vector<RecordingColumns> layouts{};  // the first whose columns are in the file's header counts
  double metresPerUnit = 1;
  // The grip's column where the grip is fully open, and where it closes: kGripCloses of a trajectory's grip.
  double gripOpen = 0, gripCloses = 0.5;
  bool hasOwnGrip = false;  // what these are is known; without it the column is a trajectory's, from 0 to 1
  // world = position + orientation * scale * mirrored; forces are only mirrored and turned.
  Eigen::Vector3d mirror = Eigen::Vector3d::Ones();  // 1 or -1 per axis
  double scale = 1;
  Eigen::Isometry3d worldFromRecording = Eigen::Isometry3d::Identity();
  Eigen::Quaterniond deviceFromTool = Eigen::Quaterniond::Identity();  // the shaft runs along the tool's +z
  // s after the first sample, which is at 0; and when the first that is left is played.
  double from = 0, to = std::numeric_limits<double>::infinity(), delay = 0;
  double smooth = 0;  // s, 0 to 1: half width of the window over which poses are averaged; more takes out more tremor
};

// By its name: a trajectory path that ends in .xml.
bool isRecording(const std::string& path);

// Throws std::runtime_error "FILE:LINE: ...", for an unknown map, unit or part with the nearest known name.
RecordingMap readRecordingMap(const std::string& path);

const XmlRules& recordingRules();

}  // namespace medulla
