#include "app/files/identified_part.h"

#include <Eigen/LU>
#include <cmath>

#include "app/files/model_rows.h"
#include "app/files/text.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

namespace {

// Computed in double and written exactly, so that only rounding separates values from the ideal.
constexpr double kRounding = 1e-9;

void putSkin(std::string& out, const IdentifiedNetwork& network) {
  putRows(out, "identified_skin", network.skin.size(), [&](std::size_t n) {
    put(out, static_cast<int>(network.skin[n].size()));
    for (const SkinFrame& f : network.skin[n]) {
      put(out, f.frame, f.weight);
      if (f.frame >= static_cast<int>(network.frames.size())) put(out, f.restPoint);
      put(out, f.map);
    }
  });
}

std::string attribute(const char* name, std::initializer_list<double> values) {
  std::string out = std::string(" ") + name + "=\"";
  for (const double value : values) {
    if (out.back() != '"') out += ' ';
    appendNumber(out, value);
  }
  return out + '"';
}

void readFrames(const std::string& path, const XmlElement& element, std::size_t spheres, IdentifiedNetwork& network) {
  Rows rows(path, element, "identified_frames");
  rows.forEach([&] {
    IdentifiedFrame& f = network.frames.emplace_back();
    rows.get(f.restPosition, f.volume, f.secondMoment);
    rows.requireMoments(f.volume, f.secondMoment);
  });
  rows.require(network.frames.size() == spheres, "expected one frame per sphere");
}

void readPatches(const std::string& path, const XmlElement& element, std::size_t nodes, IdentifiedNetwork& network) {
  for (const XmlElement* child : childrenOf(element, "identified_patch")) {
    FixedPatch& patch = network.patches.emplace_back();
    patch.region = readText(*child, "region");
    Rows rows(path, *child);
    rows.forEach([&] { patch.nodes.push_back(rows.index(nodes)); });
    rows.require(!patch.nodes.empty(), "expected at least one node");
    rows.requireAscending(patch.nodes, "nodes that are not ascending");
  }
}

void readHeldFrames(const std::string& path, const XmlElement& element, IdentifiedNetwork& network) {
  if (childrenOf(element, "identified_held").empty()) return;
  Rows rows(path, element, "identified_held");
  rows.forEach([&] { network.heldFrames.push_back(rows.index(network.frames.size())); });
  rows.requireAscending(network.heldFrames, "frames that are not ascending");
}

void readLinks(const std::string& path, const XmlElement& element, IdentifiedNetwork& network) {
  Rows rows(path, element, "identified_links");
  rows.forEach([&] {
    IdentifiedLink& l = network.links.emplace_back();
    l.frame0 = rows.index(network.frames.size());
    l.frame1 = rows.index(network.frames.size() + network.patches.size());
    rows.require(l.frame0 != l.frame1, "the same index twice");
    l.restPoint0 = network.frames[l.frame0].restPosition;
    rows.get(l.restPoint1, l.axes);
    if (l.frame1 < static_cast<int>(network.frames.size()))
      rows.require(l.restPoint1 == network.frames[l.frame1].restPosition, "a second end that is not its frame's");
    rows.require(
        (l.axes * l.axes.transpose() - Eigen::Matrix3d::Identity()).norm() <= kRounding && l.axes.determinant() > 0,
        "axes that are not unit, perpendicular and right-handed");
    for (int b = 0; b < 6; ++b) {
      for (int a = b; a < 6; ++a) {
        rows.get(l.stiffness(a, b));
        l.stiffness(b, a) = l.stiffness(a, b);
      }
    }
    const Eigen::Matrix<double, 6, 1> own = symmetricEigen(l.stiffness).values;
    rows.require(own.allFinite() && own[0] >= -kRounding * std::abs(own[5]),
                 "a stiffness that is not positive semidefinite");
  });
}

void readStrains(const std::string& path, const XmlElement& element, IdentifiedNetwork& network) {
  if (childrenOf(element, "identified_strains").empty()) return;
  Rows rows(path, element, "identified_strains");
  std::size_t next = 0;
  rows.forEach([&] {
    rows.require(next < network.links.size(), "expected one row per link");
    IdentifiedLink& l = network.links[next++];
    rows.get(l.strain0);
    if (l.frame1 < static_cast<int>(network.frames.size())) rows.get(l.strain1);
  });
  rows.require(next == network.links.size(), "expected one row per link");
}

void readSkin(const std::string& path, const XmlElement& element, std::size_t nodes, IdentifiedNetwork& network) {
  Rows rows(path, element, "identified_skin");
  const std::size_t spheres = network.frames.size();
  rows.forEach([&] {
    std::vector<SkinFrame>& frames = network.skin.emplace_back();
    const int count = rows.index(spheres + network.patches.size() + 1, 1);
    double sum = 0;
    for (int k = 0; k < count; ++k) {
      SkinFrame& f = frames.emplace_back();
      f.frame = rows.index(spheres + network.patches.size());
      rows.get(f.weight);
      if (f.frame < static_cast<int>(spheres))
        f.restPoint = network.frames[f.frame].restPosition;
      else
        rows.get(f.restPoint);
      rows.get(f.map);
      rows.require(f.weight >= 0, "a negative weight");
      sum += f.weight;
    }
    rows.require(std::abs(sum - 1) <= kRounding, "weights whose sum is not 1");
  });
  rows.require(network.skin.size() == (network.usesFormulas ? 0 : nodes),
               network.usesFormulas ? "no skin expected where formulas are used" : "expected one row per node");
}

IdentifiedError readError(const XmlElement& element, const char* name) {
  const std::vector<double> values = readNumbers(element, name, 2, kNotNegative);
  return {values[0], values[1]};
}

}  // namespace

XmlRules identifiedRules() {
  return {
      {"identified",
       {"poisson", "length_scale", "voxel", "formulas", "layer", "error_bulk", "error_poke", "error_finite_elements"},
       {},
       {{"identified_frames", 1, 1},
        {"identified_patch"},
        {"identified_held", 0, 1},
        {"identified_links", 1, 1},
        {"identified_strains", 0, 1},
        {"identified_skin", 1, 1}}},
      {"identified_frames", {"rows"}, {}, {}, true},
      {"identified_patch", {"rows", "region"}, {}, {}, true},
      {"identified_held", {"rows"}, {}, {}, true},
      {"identified_links", {"rows"}, {}, {}, true},
      {"identified_strains", {"rows"}, {}, {}, true},
      {"identified_skin", {"rows"}, {}, {}, true}};
}

void putIdentified(std::string& out, const IdentifiedNetwork& network) {
  out += "  <identified" + attribute("poisson", {network.poisson}) + attribute("length_scale", {network.lengthScale}) +
         attribute("voxel", {network.voxel}) + " formulas=\"" + (network.usesFormulas ? "yes" : "no") + '"' +
         attribute("layer", {network.layer.normal, network.layer.tangential, network.layer.membrane}) +
         attribute("error_bulk", {network.bulk.maximum, network.bulk.rms}) +
         attribute("error_poke", {network.poke.maximum, network.poke.rms}) +
         attribute("error_finite_elements", {network.ofFiniteElements.maximum, network.ofFiniteElements.rms});
  out += ">\n";
  putRows(out, "identified_frames", network.frames.size(), [&](std::size_t k) {
    const IdentifiedFrame& f = network.frames[k];
    put(out, f.restPosition, f.volume, f.secondMoment);
  });
  for (const FixedPatch& patch : network.patches) {
    putRows(
        out, "identified_patch", patch.nodes.size(), [&](std::size_t k) { put(out, patch.nodes[k]); },
        " region=\"" + escapedXml(patch.region) + '"');
  }
  if (!network.heldFrames.empty())
    putRows(out, "identified_held", network.heldFrames.size(), [&](std::size_t k) { put(out, network.heldFrames[k]); });
  putRows(out, "identified_links", network.links.size(), [&](std::size_t k) {
    const IdentifiedLink& l = network.links[k];
    put(out, l.frame0, l.frame1, l.restPoint1, l.axes);
    for (int b = 0; b < 6; ++b)
      for (int a = b; a < 6; ++a) put(out, l.stiffness(a, b));
  });
  if (hasStrains(network)) {
    putRows(out, "identified_strains", network.links.size(), [&](std::size_t k) {
      const IdentifiedLink& l = network.links[k];
      put(out, l.strain0);
      if (l.frame1 < static_cast<int>(network.frames.size())) put(out, l.strain1);
    });
  }
  putSkin(out, network);
  out += "  </identified>\n";
}

std::shared_ptr<const IdentifiedNetwork> readIdentified(const std::string& path, const XmlElement& element,
                                                        const SoftBodyModel& model) {
  auto network = std::make_shared<IdentifiedNetwork>();
  network->poisson = readNumber(element, "poisson", 0, {0, 0.5, false, true});
  network->lengthScale = readNumber(element, "length_scale", 0, kPositive);
  network->voxel = readNumber(element, "voxel", 0, kPositive);
  network->usesFormulas = readChoice(element, "formulas", {"no", "yes"}, 0) == 1;
  const std::vector<double> layer = readNumbers(element, "layer", 3, kNotNegative);
  network->layer = {layer[0], layer[1], layer[2]};
  network->bulk = readError(element, "error_bulk");
  network->poke = readError(element, "error_poke");
  network->ofFiniteElements = readError(element, "error_finite_elements");
  readFrames(path, element, model.spheres.size(), *network);
  readPatches(path, element, model.restNodes.size(), *network);
  readHeldFrames(path, element, *network);
  readLinks(path, element, *network);
  readStrains(path, element, *network);
  readSkin(path, element, model.restNodes.size(), *network);
  return network;
}

}  // namespace medulla
