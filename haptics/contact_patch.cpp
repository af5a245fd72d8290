#include "haptics/contact_patch.h"

#include <algorithm>
#include <cmath>

#include "haptics/force_bounds.h"
#include "haptics/force_shading.h"

namespace medulla {

constexpr double kWayPerRadius = 0.1;  // of the tool: a slide by so much forgets all but 1/e

// Shares so far count `factor` (0 to 1) times as much, places `ofPlaces` times.
static void fade(double factor, double ofPlaces, ContactPatch& patch) {
  // Of the largest share: a spring that is not worth its time, unless it has just begun: frames as short as a tick add
  // less to it than that.
  constexpr double least = 0.02;
  if (!patch.isTouched) patch.entries.clear();
  patch.isTouched = false;
  double largest = 0;
  for (ContactPatch::Entry& entry : patch.entries) {
    entry.weights *= ofPlaces;
    entry.placed *= ofPlaces;
    entry.normal *= ofPlaces;
    entry.share *= factor;
    largest = std::max(largest, entry.share);
  }
  std::erase_if(patch.entries, [&](const ContactPatch::Entry& e) { return !e.isTouched && e.share < least * largest; });
  for (ContactPatch::Entry& entry : patch.entries) entry.isTouched = false;
}

static Eigen::Vector3d placeOf(const BlendedSurface& surface, double alpha, const ContactPatch::Entry& entry) {
  return pointAt(surface.triangle(entry.triangle, alpha), entry.weights / entry.placed);
}

// Sideways: what a dent leaves below a tool that rides on its rim for a frame has not gone. Taken for gone, most of a
// patch was forgotten within 50 ms, and the rest swung the tool from rim to rim: 10 mm of radius on triangles of 3 mm,
// 10 mm deep, held still at 50 Hz, felt 0.3 to 0.9 N in turns where 0.77 is right. On a flat plate the gap alone says
// so at 0.35 of the radius.
static bool hasComeOff(const Proxy& proxy, double toolRadius, const Eigen::Vector3d& point,
                       const Eigen::Vector3d& normal) {
  // Of the tool's radius; at gaps of 0.02 those of the chatter itself, at 20 Hz, are taken for slides.
  constexpr double kOff = 0.06, kAside = 0.3;
  const Eigen::Vector3d off = proxy.centre - point;
  return off.norm() > proxy.radius + kOff * toolRadius && tangential(off, normal).norm() > kAside * toolRadius;
}

void fadePatch(const BlendedSurface& surface, double alpha, const Proxy& proxy, double toolRadius, double way,
               double duration, ContactPatch& patch) {
  constexpr double kShort = 0.05, kLong = 1;  // s
  const double shortest = duration / kShort,
               fading = std::min(shortest, duration / kLong + way / (kWayPerRadius * toolRadius));
  const double rest = std::exp(fading - shortest);
  for (ContactPatch::Entry& entry : patch.entries)
    if (hasComeOff(proxy, toolRadius, placeOf(surface, alpha, entry), entry.normal.normalized())) entry.share *= rest;
  fade(std::exp(-fading), std::exp(-duration / kLong), patch);
}

void addContacts(std::span<const ProxyContact> contacts, double toolRadius, double push, double way,
                 ContactPatch& patch) {
  const double kept = std::exp(-way / (kWayPerRadius * toolRadius));
  for (ContactPatch::Entry& entry : patch.entries) entry.left += way;
  for (const ProxyContact& contact : contacts) {
    const double share = push * contact.share;
    if (!(share > 0)) continue;
    auto entry = std::find_if(patch.entries.begin(), patch.entries.end(),
                              [&](const ContactPatch::Entry& e) { return e.triangle == contact.triangle; });
    if (entry == patch.entries.end()) {
      if (patch.entries.size() == kContactPatchCapacity) {
        const auto least = std::min_element(patch.entries.begin(), patch.entries.end(),
                                            [](const auto& a, const auto& b) { return a.share < b.share; });
        patch.entries.erase(least);
      }
      entry = patch.entries.insert(patch.entries.end(), {.triangle = contact.triangle});
    }
    entry->weights = kept * entry->weights + share * contact.weights;
    entry->placed = kept * entry->placed + share;
    entry->normal = kept * entry->normal + share * contact.normal;
    entry->share += share;
    entry->left = 0;
    entry->isTouched = patch.isTouched = true;
  }
}

void patchContacts(const BlendedSurface& surface, double alpha, const Proxy& proxy, double toolRadius,
                   const ContactPatch& patch, std::vector<ProxyContact>& out) {
  out.clear();
  if (!patch.isTouched) return;
  double sum = 0;
  for (const ContactPatch::Entry& entry : patch.entries) {
    ProxyContact contact;
    contact.triangle = entry.triangle;
    contact.weights = entry.weights / entry.placed;
    contact.point = placeOf(surface, alpha, entry);
    contact.share = entry.share;
    if (hasComeOff(proxy, toolRadius, contact.point, entry.normal.normalized()))
      contact.share *= std::exp(-entry.left / (kWayPerRadius * toolRadius));
    if (!(contact.share > 0)) continue;
    contact.normal = shadedNormal(surface, alpha, entry.triangle, contact.weights, entry.normal.normalized());
    sum += contact.share;
    out.push_back(contact);
  }
  for (ProxyContact& contact : out) contact.share /= sum;
}

}  // namespace medulla
