#include <algorithm>
#include <cmath>
#include <cstddef>

#include "physics/dynamics/contact_stages.h"

namespace medulla {

void placeBalls(WorldData& d) {
  const Spheres& s = d.spheres;
  ContactData& c = d.contact;
  for (std::size_t i = 0; i < s.position.size(); i += 4) {
    Lanes radius;
    const Lanes3 rest = gatherFour(c.restBall, i, radius);
    const Lanes3 frame = gatherFour(s.position, i);
    const Lanes3 centre = frame + rotate(rotationsFour(s.orientation, i), rest);
    storeFour(centre - frame, c.arm, i);
    storeFour(centre, radius, c.ball, i);
  }
}

double farthestMove(const ContactData& c, const std::vector<Quad>& from) {
  Lanes largest = splat(0);
  for (std::size_t i = 0; i < c.ball.size(); i += 4) {
    Lanes move[4];
    for (std::size_t k = 0; k < 4; ++k) {
      const Lanes change = load(c.ball[i + k]) - load(from[i + k]);
      move[k] = change * change;
    }
    largest = larger(largest, sumsOfLanes(move[0], move[1], move[2], move[3]));
  }
  return std::sqrt(largestOfLanes(largest));
}

// What balls may move before pairs are looked for anew, over that for which lists are made from them anew: more takes
// more pairs through every list, less finds them more often. Each gets three times what it moved since the last time,
// so that times grow until the fastest have all that they may: boxes of balls that lie still stay small while others
// swing. (All three times as far as a list allows: the abdomen's lists took 1.7 times the instructions.)
// What flies goes farther in a few substeps: one ball that falls for seconds had all pairs looked for in every substep.
constexpr double kMostMoves = 8, kFewestMoves = 1, kGrowth = 3, kMostSubsteps = 16;

static double moveOf(const ContactData& c, const std::vector<Quad>& from, std::size_t i) {
  const Lanes way = withoutFourth(load(c.ball[i]) - load(from[i]));
  return std::sqrt(dotProduct(way, way));
}

static void foreseeMoves(WorldData& d) {
  ContactData& c = d.contact;
  if (c.boxMove.empty()) c.boxMove.assign(c.ball.size(), kMostMoves * c.freeMove);
  for (std::size_t i = 0; i < c.ballAtBoxes.size(); ++i) {
    const double flight = kMostSubsteps * d.substep * ballVelocity(d, static_cast<std::uint32_t>(i)).norm();
    c.boxMove[i] = std::clamp(kGrowth * moveOf(c, c.ballAtBoxes, i), kFewestMoves * c.freeMove,
                              std::max(kMostMoves * c.freeMove, flight));
  }
}

static bool boxesHold(const ContactData& c) {
  for (std::size_t i = 0; i < c.ball.size(); ++i)
    if (!(moveOf(c, c.ballAtBoxes, i) <= c.boxMove[i])) return false;
  return true;
}

static void placeBoxes(ContactData& c) {
  for (std::size_t i = 0; i < c.colliders.size(); ++i) {
    const std::uint32_t s0 = c.colliders[i].sphere0, s1 = c.colliders[i].sphere1;
    const Quad &b0 = c.ball[s0], &b1 = c.ball[s1];
    const double r0 = b0.v[3] + 0.5 * c.margin + c.boxMove[s0], r1 = b1.v[3] + 0.5 * c.margin + c.boxMove[s1];
    for (int a = 0; a < 3; ++a) {
      c.boxes[i].low.v[a] = std::min(b0.v[a] - r0, b1.v[a] - r1);
      c.boxes[i].high.v[a] = std::max(b0.v[a] + r0, b1.v[a] + r1);
    }
  }
}

ConeContact closestOfPairs(const ContactData& c, const PairGroup& g) {
  const auto ends = [&](const std::uint32_t* k, std::uint32_t Collider::*end) {
    return gatherBalls(c.ball.data(), c.colliders[k[0]].*end, c.colliders[k[1]].*end, c.colliders[k[2]].*end,
                       c.colliders[k[3]].*end);
  };
  if (c.mode == ContactMode::balls)
    return {splat(0), splat(0),
            gapOfBalls(ends(g.collider0, &Collider::sphere0), ends(g.collider1, &Collider::sphere0))};
  return closestOnCones(ends(g.collider0, &Collider::sphere0), ends(g.collider0, &Collider::sphere1),
                        ends(g.collider1, &Collider::sphere0), ends(g.collider1, &Collider::sphere1));
}

namespace {

class PairList {  // fills groups of four
 public:
  explicit PairList(std::vector<PairGroup>& groups) : groups_(groups) { groups_.clear(); }
  void add(std::uint32_t i, std::uint32_t j, double gap) {
    if (count_ % 4 == 0)
      groups_.push_back({{i, i, i, i}, {j, j, j, j}, splat(std::numeric_limits<double>::infinity())});
    PairGroup& g = groups_.back();
    g.collider0[count_ % 4] = i;
    g.collider1[count_ % 4] = j;
    g.gapAtList[count_ % 4] = gap;
    ++count_;
  }

 private:
  std::vector<PairGroup>& groups_;
  int count_ = 0;
};

}  // namespace

// Pairs of overlapping boxes that may meet, now that some bodies sleep, in place; both lists ascend, so that exclusion
// is one walk.
static void dropPairsThatNeverMeet(const WorldData& d, std::vector<BoxPair>& pairs) {
  const ContactData& c = d.contact;
  const std::size_t bodies = c.rootFriction.size();
  std::size_t kept = 0, e = 0;
  std::uint32_t current = 0;
  for (const BoxPair& p : pairs) {
    const Collider &a = c.colliders[p.first], &b = c.colliders[p.second];
    if (p.first != current) e = 0;
    current = p.first;
    if (d.rest[a.body].asleep && d.rest[b.body].asleep) continue;
    if (a.body == b.body) {
      const std::vector<std::uint32_t>& excluded = c.excluded[p.first];
      while (e < excluded.size() && excluded[e] < p.second) ++e;
      if (e < excluded.size() && excluded[e] == p.second) continue;
    } else if (!c.collides[a.body * bodies + b.body]) {
      continue;
    }
    pairs[kept++] = p;
  }
  pairs.resize(kept);
}

// Every pair that may come nearer than the margin while no ball moves by more than its box allows.
static void findPairsOfBoxes(WorldData& d) {
  ContactData& c = d.contact;
  foreseeMoves(d);
  c.ballAtBoxes = c.ball;
  placeBoxes(c);
  findOverlaps(c.boxes, c.broadPhase);
  dropPairsThatNeverMeet(d, c.broadPhase.pairs);
}

void listNeighbours(WorldData& d) {
  ContactData& c = d.contact;
  if (c.listsAreOld || !boxesHold(c)) findPairsOfBoxes(d);
  c.ballAtList = c.ball;
  const std::vector<BoxPair>& pairs = c.broadPhase.pairs;
  PairList list(c.pairs);
  for (std::size_t k = 0; k < pairs.size(); k += 4) {
    PairGroup g{};
    const std::size_t count = std::min<std::size_t>(4, pairs.size() - k);
    for (std::size_t l = 0; l < 4; ++l) {
      const BoxPair& p = pairs[k + std::min(l, count - 1)];
      g.collider0[l] = p.first;
      g.collider1[l] = p.second;
    }
    const Lanes gap = closestOfPairs(c, g).gap;
    for (std::size_t l = 0; l < count; ++l)
      if (gap[l] <= c.margin) list.add(g.collider0[l], g.collider1[l], gap[l]);
  }
  listStaticNeighbours(d);
  c.listsAreOld = false;
}

}  // namespace medulla
