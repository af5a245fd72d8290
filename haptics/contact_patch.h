#pragma once

#include <span>
#include <vector>

#include "haptics/proxy.h"

namespace medulla {

// Where on the surface a tool pushed, in the ticks of this dynamics frame and, fading, of those before: per touched
// triangle the mean barycentric point, over the last tenth of the tool's radius that it went, and the share of the
// push. The dynamics gets one spring per entry. Coarsely meshed tissue that is softer than the tool alternates between
// neighbouring triangles: what is pushed gives way, its neighbour stands out and is pushed in its place, the more often
// the shorter the frame. Pushing where the tool has been lately has no such cycle.
struct ContactPatch {
  struct Entry {
    int triangle = -1;
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();  // barycentric times share, summed over ticks
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();   // of the contacts, likewise
    double placed = 0;                                  // shares in both
    double share = 0;                                   // summed over ticks
    double left = 0;                                    // m, that the tool has gone since
    bool isTouched = false;                             // in this frame
  };
  std::vector<Entry> entries;  // in order of first touch; capacity is reserved, ticks allocate nothing
  bool isTouched = false;      // in this frame, or not yet left
};

constexpr int kContactPatchCapacity = 64;  // triangles; beyond, a new one takes the place of the least share

// Begins a frame: pushes of those before count less, and nothing after a frame without any. By what the device went,
// `way` (m), in the frame that ended, of `duration` (s). A proxy presses on three triangles at most, while the dent of
// a tool that is wide against the mesh has many: their shares are learnt over many frames, as a mean that converges
// like 1 / frames. A tool that moves forgets within 50 ms, one that holds still within a second. What has come off the
// proxy, as by tissue that slides along under a still tool, is forgotten within 50 ms, too.
void fadePatch(const BlendedSurface& surface, double alpha, const Proxy& proxy, double toolRadius, double way,
               double duration, ContactPatch& patch);

// Adds what is touched in one tick, or left, each contact by its share of `push` (m, >= 0: how deep the device is).
// `way` (m): what the device went, or what the proxy slid on the tissue where that is more, as on tissue that moves
// along under a still tool.
void addContacts(std::span<const ProxyContact> contacts, double toolRadius, double push, double way,
                 ContactPatch& patch);

// The patch as contacts of the surface at alpha, shares summing to 1, with the shaded normals along which the hand
// feels them; of an edge that of the touch, since from a place that trails behind, the way to the proxy leans forward,
// and a tool without friction that slid in a groove dragged it by 6 % of its push; none if nothing was touched in this
// frame and what was before has been left. What has come off the proxy counts the less the farther the tool has gone
// since it touched it: e^-1 per tenth of its radius. Pushes that trail behind by the 50 ms took a tool of 4 mm, 1 mm
// deep at 0.1 m/s, 28 % of its push on a flat plate, and one of 1 mm nearly all. `out` is cleared and filled.
void patchContacts(const BlendedSurface& surface, double alpha, const Proxy& proxy, double toolRadius,
                   const ContactPatch& patch, std::vector<ProxyContact>& out);

}  // namespace medulla
