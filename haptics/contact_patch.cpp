#include "haptics/contact_patch.h"

#include <algorithm>
#include <cmath>

#include "haptics/force_shading.h"

namespace medulla {

// Pushes so far count `factor` (0 to 1) times as much.
static void fade(double factor, ContactPatch& patch) {
  // Of the largest share: a spring that is not worth its time, unless it has just begun: frames as short as a tick add
  // less to it than that.
  constexpr double least = 0.02;
  if (!patch.isTouched) patch.entries.clear();
  patch.isTouched = false;
  double largest = 0;
  for (ContactPatch::Entry& entry : patch.entries) {
    entry.weights *= factor;
    entry.share *= factor;
    largest = std::max(largest, entry.share);
  }
  std::erase_if(patch.entries, [&](const ContactPatch::Entry& e) { return !e.isTouched && e.share < least * largest; });
  patch.total = 0;
  for (ContactPatch::Entry& entry : patch.entries) {
    patch.total += entry.share;
    entry.isTouched = false;
  }
}

void fadePatch(const BlendedSurface& surface, double alpha, const Proxy& proxy, double toolRadius, double way,
               double duration, ContactPatch& patch) {
  constexpr double kShort = 0.05, kLong = 1;  // s
  constexpr double
      kWayPerRadius = 0.1,
      kOff = 0.06;  // of the tool's radius; at 0.02 gaps of the chatter itself, at 20 Hz, are taken for slides
  const double shortest = duration / kShort,
               fading = std::min(shortest, duration / kLong + way / (kWayPerRadius * toolRadius));
  const double off = proxy.radius + kOff * toolRadius, rest = std::exp(fading - shortest);
  for (ContactPatch::Entry& entry : patch.entries) {
    const Eigen::Vector3d point = pointAt(surface.triangle(entry.triangle, alpha), entry.weights / entry.share);
    if ((proxy.centre - point).norm() <= off) continue;
    entry.weights *= rest;
    entry.share *= rest;
  }
  fade(std::exp(-fading), patch);
}

void addContacts(const Proxy& proxy, double push, ContactPatch& patch) {
  for (int k = 0; k < proxy.contactCount; ++k) {
    const ProxyContact& contact = proxy.contacts[k];
    const double share = push * contact.share;
    if (!(share > 0)) continue;
    auto entry = std::find_if(patch.entries.begin(), patch.entries.end(),
                              [&](const ContactPatch::Entry& e) { return e.triangle == contact.triangle; });
    if (entry == patch.entries.end()) {
      if (patch.entries.size() == kContactPatchCapacity) {
        const auto least = std::min_element(patch.entries.begin(), patch.entries.end(),
                                            [](const auto& a, const auto& b) { return a.share < b.share; });
        patch.total -= least->share;
        patch.entries.erase(least);
      }
      entry = patch.entries.insert(patch.entries.end(), {contact.triangle, Eigen::Vector3d::Zero(), 0, false});
    }
    entry->weights += share * contact.weights;
    entry->share += share;
    patch.total += share;
    entry->isTouched = patch.isTouched = true;
  }
}

void patchContacts(const BlendedSurface& surface, double alpha, const Proxy& proxy, const ContactPatch& patch,
                   std::vector<ProxyContact>& out) {
  out.clear();
  if (!patch.isTouched) return;
  for (const ContactPatch::Entry& entry : patch.entries) {
    ProxyContact contact;
    contact.triangle = entry.triangle;
    contact.weights = entry.weights / entry.share;
    contact.share = entry.share / patch.total;
    contact.point = pointAt(surface.triangle(entry.triangle, alpha), contact.weights);
    const Eigen::Vector3d outward = proxy.centre - contact.point;
    const double distance = outward.norm();
    if (!(distance > 0)) continue;  // the point lies in the proxy's centre: no direction to push it
    contact.normal = shadedNormal(surface, alpha, entry.triangle, contact.weights, outward / distance);
    out.push_back(contact);
  }
}

}  // namespace medulla
