#pragma once

#include <cstdint>

#include "physics/dynamics/stages.h"
#include "physics/dynamics/world_data.h"

// States that no scene reaches, and sums over a world.
namespace medulla::states {

using Eigen::Quaterniond;
using Eigen::Vector3d;

class Random {  // xorshift64*
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 2654435769u + 1) {}
  double uniform() {  // -1..1
    state_ ^= state_ >> 12;
    state_ ^= state_ << 25;
    state_ ^= state_ >> 27;
    return static_cast<double>((state_ * 2685821657736338717ULL) >> 11) / 4503599627370496.0 - 1;
  }
  Vector3d vector() {
    const double x = uniform(), y = uniform(), z = uniform();
    return {x, y, z};
  }

 private:
  std::uint64_t state_;
};

Quaterniond orientation(const WorldData& d, int i);
void setOrientation(WorldData& d, int i, const Quaterniond& q);
void turnBy(WorldData& d, int i, const Vector3d& rotation);

Eigen::Matrix3d inertia(const WorldData& d, int i);  // world frame
void setAngularVelocity(WorldData& d, int i, const Vector3d& omega);
double sphereMass(const WorldData& d, int i);

// Every sphere turned by up to `angle` (rad) and every sphere and free node moved by up to `shift` (m), spun and
// thrown.
void shake(WorldData& d, std::uint64_t seed, double angle, double shift, double speed);

WorldSettings weightless(int substeps = 0);

struct Momentum {
  Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();
  double linearScale = 0, angularScale = 0;  // sums of magnitudes: what rounding is relative to
};

Momentum momentum(const WorldData& d);

double elastic(WorldData& d);

// Central differences of the elastic energy along every freedom, against the forces.
void expectForcesAreMinusGradient(WorldData& d, double tolerance);

// Of a free body thrown about, while it is damped.
void expectMomentaStay(World& world);

// Of an undamped one.
void expectEnergyStays(World& world);

void expectEnergyIsTakenInEveryFrame(World& world);

}  // namespace medulla::states
