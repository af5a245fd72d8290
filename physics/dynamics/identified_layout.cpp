#include "physics/dynamics/identified_layout.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>

#include "physics/dynamics/identified_measures.h"

namespace medulla {

namespace {

using Eigen::Vector3d;

// One body's frames: its spheres', and the points of held patches that links and nodes ask for, each once.
class FrameNumbers {
 public:
  FrameNumbers(WorldData& d, int body) : s_(&d.identified), description_(&d.bodies[body]) {
    first_ = static_cast<int>(s_->frames.size());
    const SoftBodyModel& m = *description_->model;
    for (std::size_t i = 0; i < m.spheres.size(); ++i) {
      const Vector3d rest = m.identified->frames[i].restPosition;
      append(rest, {d.ranges[body].firstSphere + static_cast<int>(i), quadOf(rest - m.spheres[i].restFrame), {}});
    }
  }
  int of(int frame, const Vector3d& restPoint) {
    if (frame < static_cast<int>(description_->model->spheres.size())) return first_ + frame;
    const auto [found, isNew] = held_.try_emplace({restPoint.x(), restPoint.y(), restPoint.z()}, 0);
    if (isNew) {
      found->second = static_cast<int>(s_->frames.size());
      append(restPoint, {-1, {}, {}});
    }
    return found->second;
  }
  Vector3d restPoint(int frame, const Vector3d& ofPatch) const {
    const IdentifiedNetwork& n = *description_->model->identified;
    return frame < static_cast<int>(n.frames.size()) ? n.frames[frame].restPosition : ofPatch;
  }
  int first() const { return first_; }
  int end() const { return static_cast<int>(s_->frames.size()); }

 private:
  void append(const Vector3d& rest, const CarriedFrame& carried) {
    const Eigen::Quaterniond q = Eigen::Quaterniond(description_->worldFromModel.rotation()).normalized();
    FrameState state;
    state.position = quadOf(description_->worldFromModel * rest);
    state.orientation = {{q.x(), q.y(), q.z(), q.w()}};
    s_->frames.push_back(state);
    s_->carried.push_back(carried);
  }

  Identified* s_;
  const BodyDescription* description_;
  int first_;
  std::map<std::array<double, 3>, int> held_;
};

IdentifiedLinkGroup emptyGroup(int frame) {  // links between a frame and itself, without stiffness
  IdentifiedLinkGroup g{};
  std::fill_n(g.frame0, 4, static_cast<std::uint32_t>(frame));
  std::fill_n(g.frame1, 4, static_cast<std::uint32_t>(frame));
  g.inverseRestLength = splat(1);
  return g;
}

void addLinks(WorldData& d, int body, const BodyMechanics& mechanics, FrameNumbers& frames) {
  const IdentifiedNetwork& n = *d.bodies[body].model->identified;
  std::vector<IdentifiedLinkGroup>& groups = d.identified.links;
  for (std::size_t k = 0; k < n.links.size(); ++k) {
    const IdentifiedLink& link = n.links[k];
    const int l = static_cast<int>(k % 4);
    if (l == 0) groups.push_back(emptyGroup(frames.first()));
    IdentifiedLinkGroup& g = groups.back();
    g.frame0[l] = static_cast<std::uint32_t>(frames.of(link.frame0, link.restPoint0));
    g.frame1[l] = static_cast<std::uint32_t>(frames.of(link.frame1, link.restPoint1));
    const Vector3d line =
        frames.restPoint(link.frame1, link.restPoint1) - frames.restPoint(link.frame0, link.restPoint0);
    setLane(g.restLine, l, line);
    setLane(g.along, l, link.axes.row(0).transpose());
    g.restLength[l] = line.norm();
    g.inverseRestLength[l] = 1 / line.norm();
    g.lengthScale[l] = n.lengthScale;
    g.relaxation[l] = mechanics.linkRelaxation;
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) g.stiffness[entryOf(i, j)][l] = mechanics.identifiedLinks[k](i, j);
    ++d.identified.linkCount;
  }
}

void setTerm(SkinTerm& term, int lane, const SkinFrame& f, int frame, const Vector3d& place, double lengthScale) {
  term.frame[lane] = static_cast<std::uint32_t>(frame);
  term.weight[lane] = f.weight;
  setLane(term.restPlace, lane, place);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      term.map[6 * i + j][lane] = static_cast<float>(f.map(i, j));
      // A small rotation is twice its quaternion's vector part.
      term.map[6 * i + 3 + j][lane] = static_cast<float>(2 * lengthScale * f.map(i, 3 + j));
    }
  }
}

SkinTerm emptyTerm(int frame) {
  SkinTerm term{};
  std::fill_n(term.frame, 4, static_cast<std::uint32_t>(frame));
  return term;
}

// The four nodes of group g, -1 on pads.
void addSkin(WorldData& d, int body, const BodyMechanics& mechanics, const std::array<int, 4>& nodes, int g,
             FrameNumbers& frames) {
  Identified& s = d.identified;
  const SoftBodyModel& m = *d.bodies[body].model;
  SkinGroup group{};
  group.firstTerm = static_cast<int>(s.terms.size());
  std::size_t most = 0;
  for (const int node : nodes)
    if (node >= 0) most = std::max(most, mechanics.skin[node].size());
  group.endTerm = group.firstTerm + static_cast<int>(most);
  s.terms.resize(group.endTerm, emptyTerm(frames.first()));
  for (int l = 0; l < 4; ++l) {
    if (nodes[l] < 0) continue;
    const std::vector<SkinFrame>& skin = mechanics.skin[nodes[l]];
    Vector3d mean = Vector3d::Zero();
    for (const SkinFrame& f : skin) mean += f.weight * frames.restPoint(f.frame, f.restPoint);
    for (std::size_t k = 0; k < skin.size(); ++k)
      setTerm(s.terms[group.firstTerm + k], l, skin[k], frames.of(skin[k].frame, skin[k].restPoint),
              frames.restPoint(skin[k].frame, skin[k].restPoint) - mean, m.identified->lengthScale);
    setLane(group.restOffset, l, m.restNodes[nodes[l]] - mean);
    const double area = mechanics.attachments[nodes[l]].area;
    if (area > 0) group.normalExcess[l] = mechanics.normalExcess[nodes[l]] / (area * area);
  }
  s.ofNodeGroup[g] = static_cast<int>(s.skin.size());
  s.skin.push_back(group);
}

}  // namespace

void layOutIdentified(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  Identified& s = d.identified;
  s.ofNodeGroup.assign(d.nodes.count / 4, -1);
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    if (d.bodies[b].links != LinkModel::identified) continue;
    const int body = static_cast<int>(b);
    FrameNumbers frames(d, body);
    const int firstLinkGroup = static_cast<int>(s.links.size());
    addLinks(d, body, mechanics[b], frames);
    std::map<int, std::array<int, 4>> groups;
    for (std::size_t i = 0; i < d.ranges[b].node.size(); ++i) {
      const int place = d.ranges[b].node[i];
      groups.try_emplace(place / 4, std::array<int, 4>{-1, -1, -1, -1}).first->second[place % 4] = static_cast<int>(i);
    }
    for (const auto& [g, nodes] : groups) addSkin(d, body, mechanics[b], nodes, g, frames);
    s.bodies.push_back({body, frames.first(), frames.end(), firstLinkGroup, static_cast<int>(s.links.size())});
  }
  s.loads.resize(s.frames.size());
  s.termStates.resize(s.terms.size());
  s.skinStates.resize(s.skin.size());
}

}  // namespace medulla
