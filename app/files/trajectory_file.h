#pragma once

#include <string>

#include "haptics/tool_input.h"

namespace medulla {

// CSV with the header t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip; # starts a comment; time strictly increasing; quaternions
// normalised within 1e-3, else refused; optional further columns fx[N],fy[N],fz[N] are accepted.
// Throws std::runtime_error "FILE:LINE: ...".
Trajectory readTrajectory(const std::string& path);

}  // namespace medulla
