#pragma once

#include <string>
#include <string_view>

#include "haptics/tool_input.h"

namespace medulla {

// CSV with the header t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip in this order; # starts a comment; time strictly increasing;
// positions within toolReach; grip in 0..1; quaternions normalised within 1e-3, else refused; the further columns
// fx[N],fy[N],fz[N] (all three or none) are checked and ignored.
// Throws std::runtime_error "FILE:LINE: ...".
Trajectory readTrajectory(const std::string& path);

// The same from text in memory; `name` stands for the file in errors.
Trajectory parseTrajectory(std::string_view text, const std::string& name);

}  // namespace medulla
