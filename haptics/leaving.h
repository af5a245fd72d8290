#pragma once

#include "haptics/servo_tool.h"

namespace medulla {

// In the late surface a tool that withdraws loses contact before the tissue, in the dynamics, lets go of it. The
// contact is therefore handed over until the tool is clear of the point by its radius: springs that only push do no
// harm where nothing is pushed, and without them the tissue would jump free and knock against the tool. All of the
// patch: with the last triangle alone, the nodes around it did so, and a tool that left a limp organ felt up to three
// times what it had just held.
//
// Where it slides meanwhile, what it leaves is what lies below it. The place where it touched last would be seen from
// aside, past the tool's flank: a stroke of the gallbladder that was lifted off let the tissue jump up to it, and felt
// 0.107 N where it had 0.03. What is felt comes from there as far as the last place lies aside: straight off, the
// nearest place is a dent's rim, and of what a stiff tool pressed into a slab it gave back twice as much and more.
void followLeaving(const Buckets& buckets, double alphaBefore, double alpha, ServoTool& tool);

// What was touched in this tick, or lies below a tool that is leaving, after it went `way` (m; as addContacts()).
void addToPatch(double way, ServoTool& tool);

}  // namespace medulla
