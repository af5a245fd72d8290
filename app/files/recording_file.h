#pragma once

#include <string>
#include <string_view>

#include "app/files/recording_map.h"
#include "haptics/tool_input.h"

namespace medulla {

// The recording that a map describes, as a trajectory: in metres, seconds and the frame of the scene. Rows are never
// left out or mended. Throws std::runtime_error: "MAP:LINE: ..." where the file is missing, "FILE:LINE: ..." for a row
// of another length, a cell that is no finite number, a rotation that is none (quaternions as addSample() has them, a
// matrix off by 2e-3 at most), a time that does not grow, and columns that the header has not, naming the nearest.
Trajectory readRecording(const RecordingMap& map);

// The same from text in memory; `name` stands for the file in errors.
Trajectory parseRecording(std::string_view text, const std::string& name, const RecordingMap& map);

}  // namespace medulla
