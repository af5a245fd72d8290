#pragma once

#include <vector>

#include "haptics/proxy.h"

namespace medulla {

// Where on the surface a tool pushed during the ticks of one dynamics frame: per touched triangle the mean barycentric
// point and the share of the push. The dynamics gets one spring per entry. Handing over the last tick's contact alone
// makes soft, coarsely meshed tissue alternate between two neighbouring triangles: what is pushed gives way, the
// neighbour stands out and is pushed in the next frame; spreading the push over the frame's ticks has no such cycle.
struct ContactPatch {
  struct Entry {
    int triangle = -1;
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();  // barycentric times share, summed over ticks
    double share = 0;                                   // summed over ticks
  };
  std::vector<Entry> entries;  // in order of first touch; capacity is reserved, ticks allocate nothing
  double total = 0;            // of the shares
};

constexpr int contactPatchCapacity = 64;  // triangles; a proxy that slides over more in one frame keeps the first ones

void clearPatch(ContactPatch& patch);

// Adds the proxy's contacts of one tick, each by its share of `push` (N, >= 0).
void addContacts(const Proxy& proxy, double push, ContactPatch& patch);

// The patch as contacts of the surface at alpha, shares summing to 1, with the shaded normals along which the hand
// feels them. `out` is cleared and filled.
void patchContacts(const BlendedSurface& surface, double alpha, const Proxy& proxy, const ContactPatch& patch,
                   std::vector<ProxyContact>& out);

}  // namespace medulla
