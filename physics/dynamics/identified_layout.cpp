#include "physics/dynamics/identified_layout.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <set>
#include <vector>

#include "physics/dynamics/identified_measures.h"
#include "physics/dynamics/identified_mechanics.h"
#include "physics/dynamics/skin_map.h"

namespace medulla {

namespace {

using Eigen::Matrix3d;
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

// m: what a link stretches. One that is held bends about where it is clamped, but no more than what lies between its
// cell and the patch's nearest node becomes longer.
double stretchedLength(const SoftBodyModel& m, const IdentifiedLink& link, const Vector3d& line) {
  double length = line.norm();
  const std::size_t spheres = m.spheres.size(), frame = static_cast<std::size_t>(link.frame1);
  if (frame < spheres) return length;
  for (const int node : m.identified->patches[frame - spheres].nodes)
    length = std::min(length, (m.restNodes[node] - link.restPoint0).norm());
  return length;
}

void addLinks(WorldData& d, int body, const BodyMechanics& mechanics, FrameNumbers& frames) {
  const IdentifiedNetwork& n = *d.bodies[body].model->identified;
  std::vector<IdentifiedLinkGroup>& groups = d.identified.links;
  const std::vector<bool> bars = barsAmong(n);
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
    g.restLength[l] = stretchedLength(*d.bodies[body].model, link, line);
    g.inverseRestLength[l] = 1 / g.restLength[l];
    g.lengthScale[l] = n.lengthScale;
    g.relaxation[l] = mechanics.linkRelaxation;
    const LinkBending bending = bars[k] ? linkBending(n, link) : LinkBending();
    g.softening[l] = bending.softening;
    g.lengthening[l] = bending.lengthening;
    g.bound[l] = bending.bound;
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) g.stiffness[entryOf(i, j)][l] = mechanics.identifiedLinks[k](i, j);
    for (int i = 0; i < 6 && !mechanics.identifiedStrains.empty(); ++i) {
      g.strain0[i][l] = mechanics.identifiedStrains[k].at0[i];
      g.strain1[i][l] = mechanics.identifiedStrains[k].at1[i];
    }
    ++d.identified.linkCount;
  }
}

// The frames that the nodes of a host hang on: its home first, then those that turn its own frame, then all others.
class HostTerms {
 public:
  HostTerms(int home, const Vector3d& homePlace) : frames_{{home, homePlace, 0}}, number_{{home, 0}} {}
  const Vector3d& homePlace() const { return frames_.front().restPlace; }
  int of(int frame) const { return number_.at(frame); }

  // A node has so much of a frame. What is held is turned nowhere, wherever a patch is seen from: one frame stands for
  // all in how the host's own is turned.
  void weigh(const CarriedFrame& carried, int frame, const Vector3d& restPlace, double weight) {
    int number = number_.try_emplace(frame, static_cast<int>(frames_.size())).first->second;
    if (number == static_cast<int>(frames_.size())) frames_.push_back({frame, restPlace, 0});
    if (carried.sphere < 0) held_ = number = held_ < 0 ? number : held_;
    frames_[number].weight += weight;
  }
  // After all nodes: returns the new host.
  int append(Identified& s, double poisson) {
    const auto isBefore = [](const Hosted& a, const Hosted& b) { return a.weight > b.weight; };
    std::stable_sort(frames_.begin() + 1, frames_.end(), isBefore);
    SkinHost host{};
    host.home = frames_.front().frame;
    host.thinning = thinningOf(poisson);
    host.firstTerms = static_cast<int>(s.terms.size());
    host.turnShares = std::min(static_cast<int>(frames_.size()), kSkinFrames);
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      number_[frames_[k].frame] = static_cast<int>(k);
      if (k % 4 == 0) appendEmptyTerms(s, host.home);
      setTerm(frames_[k], static_cast<int>(k % 4), s.terms.back());
    }
    host.endTerms = static_cast<int>(s.terms.size());
    setShares(host, s.terms);
    s.hosts.push_back(host);
    return static_cast<int>(s.hosts.size()) - 1;
  }

 private:
  struct Hosted {
    int frame;
    Vector3d restPlace;
    double weight;
  };
  static void appendEmptyTerms(Identified& s, int home) {
    SkinTerms terms{};
    std::fill_n(terms.frame, 4, static_cast<std::uint32_t>(home));
    s.terms.push_back(terms);
  }
  void setTerm(const Hosted& of, int lane, SkinTerms& terms) const {
    const Vector3d line = of.restPlace - homePlace();
    terms.frame[lane] = static_cast<std::uint32_t>(of.frame);
    setLane(terms.restPlace, lane, line);
    if (line.norm() == 0) return;
    setLane(terms.axis, lane, line.normalized());
    terms.length[lane] = line.norm();
    terms.inverseLength[lane] = 1 / line.norm();
  }
  // How the host's own frame is turned: home counts three times as much as all of the six frames together that the
  // nodes have most of. With these alone bodies that bend swell, as blends of rotations let them; with home alone they
  // shrink (tests/accuracy/limits.md).
  void setShares(const SkinHost& host, std::vector<SkinTerms>& terms) const {
    constexpr double kHome = 3;
    double sum = 0;
    for (int k = 0; k < host.turnShares; ++k) sum += frames_[k].weight;
    for (int k = 0; k < host.turnShares; ++k) {
      const double all = sum > 0 ? frames_[k].weight / sum : k == 0 ? 1 : 0;
      terms[host.firstTerms + k / 4].share[k % 4] = (all + (k == 0 ? kHome : 0)) / (1 + kHome);
    }
  }

  std::vector<Hosted> frames_;
  std::map<int, int> number_;
  int held_ = -1;
};

void setColumns(const Matrix3d& map, int lane, float (*columns)[4]) {
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) columns[3 * j + i][lane] = static_cast<float>(map(i, j));
}

// `axis`: from home to the frame.
void setMap(SkinShare& share, int lane, const SkinRow& row, double weight, const Vector3d& axis) {
  share.weight[lane] = static_cast<float>(weight);
  share.along[lane] = static_cast<float>(axis.dot(row.onWay * axis));
  setColumns(row.onWay, lane, share.map);
  setColumns(row.onTurn, lane, share.map + 9);
}

// Four nodes, -1 on pads.
void addSkin(WorldData& d, int body, const BodyMechanics& mechanics, const std::array<int, 4>& nodes, int host,
             const HostTerms& terms, FrameNumbers& frames) {
  Identified& s = d.identified;
  const SoftBodyModel& m = *d.bodies[body].model;
  SkinGroup group{};
  group.host = host;
  group.firstShare = static_cast<int>(s.shares.size());
  std::map<int, SkinShare> shares;  // by the frame's number in the host
  for (int l = 0; l < 4; ++l) {
    if (nodes[l] < 0) continue;
    const std::vector<SkinFrame>& skin = mechanics.skin[nodes[l]];
    const std::vector<SkinRow> rows = skinRows(m, skin, nodes[l]);
    for (std::size_t k = 0; k < skin.size() && mechanics.nodeMoves[nodes[l]]; ++k) {
      const int frame = frames.of(skin[k].frame, skin[k].restPoint);
      const Vector3d place = frames.restPoint(skin[k].frame, skin[k].restPoint);
      const int term = terms.of(frame);
      if (term == 0) {
        setColumns(rows[k].onTurn, l, group.homeTurn);
        group.homeWeight[l] = static_cast<float>(skin[k].weight);
        continue;
      }
      SkinShare& share = shares[term];
      constexpr int kDoubles = sizeof(SkinTermState) / sizeof(double);
      share.term = term;
      share.state = kDoubles * (term / 4) + term % 4;
      setMap(share, l, rows[k], skin[k].weight, (place - terms.homePlace()).normalized());
    }
    setLane(group.restOffset, l, m.restNodes[nodes[l]] - terms.homePlace());
    setLane(group.lever, l, skinLever(m, skin, nodes[l]));
    const double area = mechanics.attachments[nodes[l]].area;
    if (area > 0) group.normalExcess[l] = mechanics.normalExcess[nodes[l]] / (area * area);
  }
  for (const auto& [term, share] : shares) s.shares.push_back(share);
  group.endShare = static_cast<int>(s.shares.size());
  s.skin.push_back(group);
}

HostTerms termsOf(const WorldData& d, const BodyMechanics& mechanics, int home, const Vector3d& homePlace,
                  std::span<const int> nodes, FrameNumbers& frames) {
  HostTerms terms(home, homePlace);
  for (const int node : nodes) {
    if (node < 0 || !mechanics.nodeMoves[node]) continue;
    for (const SkinFrame& f : mechanics.skin[node]) {
      const int frame = frames.of(f.frame, f.restPoint);
      terms.weigh(d.identified.carried[frame], frame, frames.restPoint(f.frame, f.restPoint), f.weight);
    }
  }
  return terms;
}

void addSkins(WorldData& d, int body, const BodyMechanics& mechanics, FrameNumbers& frames) {
  Identified& s = d.identified;
  std::vector<int> nodeAt(d.nodes.count, -1);
  for (std::size_t i = 0; i < d.ranges[body].node.size(); ++i) nodeAt[d.ranges[body].node[i]] = static_cast<int>(i);
  for (const std::vector<HostRange>* ranges : {&d.nodes.onSpheres, &d.nodes.skinOnSpheres}) {
    for (const HostRange& range : *ranges) {
      if (range.body != body) continue;
      const std::span<const int> nodes(nodeAt.data() + 4 * range.firstGroup, nodeAt.data() + 4 * range.endGroup);
      const SkinFrame& first = mechanics.skin[nodes[0]].front();
      // Held nodes all hang on patches, which do not move against each other.
      const int home = mechanics.nodeMoves[nodes[0]] ? range.host - d.ranges[body].firstSphere : first.frame;
      HostTerms terms = termsOf(d, mechanics, frames.of(home, first.restPoint), frames.restPoint(home, first.restPoint),
                                nodes, frames);
      const int host = terms.append(s, d.bodies[body].tissue.poisson);
      for (int g = range.firstGroup; g < range.endGroup; ++g) {
        s.ofNodeGroup[g] = static_cast<int>(s.skin.size());
        addSkin(d, body, mechanics, {nodeAt[4 * g], nodeAt[4 * g + 1], nodeAt[4 * g + 2], nodeAt[4 * g + 3]}, host,
                terms, frames);
      }
    }
  }
}

// What the nodes of a group ask for; time that a frame takes is that of some two edges.
class GroupCost {
 public:
  GroupCost(const BodyMechanics& mechanics, const std::vector<int>& edges) : mechanics_(&mechanics), edges_(&edges) {}
  int with(int node) const {
    int frames = 0;
    for (const SkinFrame& f : mechanics_->skin[node]) frames += frames_.count(f.frame) == 0 ? 1 : 0;
    return 2 * frames + std::max((*edges_)[node] - mostEdges_, 0);
  }
  void add(int node) {
    for (const SkinFrame& f : mechanics_->skin[node]) frames_.insert(f.frame);
    mostEdges_ = std::max(mostEdges_, (*edges_)[node]);
  }

 private:
  const BodyMechanics* mechanics_;
  const std::vector<int>* edges_;
  std::set<int> frames_;
  int mostEdges_ = 0;
};

}  // namespace

// Each group begins with the dearest node that is left and takes those that add least.
void groupByFrames(const BodyMechanics& mechanics, const std::vector<int>& edges, std::span<int> nodes) {
  for (std::size_t first = 0; first < nodes.size(); first += 4) {
    GroupCost group(mechanics, edges);
    for (std::size_t k = first; k < std::min(first + 4, nodes.size()); ++k) {
      const auto isBetter = [&](int i, int j) {
        return k == first ? group.with(i) > group.with(j) : group.with(i) < group.with(j);
      };
      std::iter_swap(nodes.begin() + k, std::min_element(nodes.begin() + k, nodes.end(), isBetter));
      group.add(nodes[k]);
    }
  }
}

void layOutIdentified(WorldData& d, const std::vector<BodyMechanics>& mechanics) {
  Identified& s = d.identified;
  s.ofNodeGroup.assign(d.nodes.count / 4, -1);
  s.bodies.resize(d.bodies.size());
  for (std::size_t b = 0; b < d.bodies.size(); ++b) {
    if (d.bodies[b].links != LinkModel::identified) continue;
    const int body = static_cast<int>(b);
    FrameNumbers frames(d, body);
    const int firstLinkGroup = static_cast<int>(s.links.size());
    addLinks(d, body, mechanics[b], frames);
    addSkins(d, body, mechanics[b], frames);
    s.bodies[b] = {frames.first(), frames.end(), firstLinkGroup, static_cast<int>(s.links.size()),
                   !mechanics[b].identifiedStrains.empty()};
  }
  if (std::any_of(s.bodies.begin(), s.bodies.end(), [](const IdentifiedBody& body) { return body.hasStrains; })) {
    s.strained.resize(s.links.size());
    s.strains.resize(s.frames.size());
  }
  s.stillStrains.resize(s.frames.size());
  s.loads.resize(s.frames.size());
  s.termStates.resize(s.terms.size());
  int most = 0;
  for (const SkinHost& host : s.hosts) most = std::max(most, host.endTerms - host.firstTerms);
  s.termLoads.resize(4 * most);
  s.turns.resize(s.skin.size());
}

}  // namespace medulla
