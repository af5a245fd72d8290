#include "physics/model/torsion_constant.h"

#include <Eigen/Cholesky>
#include <array>
#include <complex>

namespace medulla {

namespace {

constexpr int kDegree = 6, kWarpings = 2 * kDegree;
using Complex = std::complex<double>;
using Gram = Eigen::Matrix<double, kWarpings, kWarpings>;
using Column = Eigen::Matrix<double, kWarpings, 1>;

// Gauss's points and weights on (-1, 1), exact up to degree 11: products of gradients have degree 2 (kDegree - 1).
constexpr std::array<std::array<double, 2>, 6> kAlong = {{{-0.932469514203152, 0.171324492379170},
                                                          {-0.661209386466265, 0.360761573048139},
                                                          {-0.238619186083197, 0.467913934572691},
                                                          {0.238619186083197, 0.467913934572691},
                                                          {0.661209386466265, 0.360761573048139},
                                                          {0.932469514203152, 0.171324492379170}}};
constexpr double kAcross = 0.577350269189626;  // of two points, as exact for second moments as the strip is

// Gradients of Re z^k and Im z^k, k = 1 to kDegree, as columns u and v: d/dz z^k = k z^(k-1) = w_u - i w_v.
void gradients(Complex z, Column& along, Column& across) {
  Complex power = 1;
  for (int k = 1; k <= kDegree; ++k) {
    const Complex slope = static_cast<double>(k) * power;
    along[2 * k - 2] = slope.real();
    across[2 * k - 2] = -slope.imag();
    along[2 * k - 1] = slope.imag();
    across[2 * k - 1] = slope.real();
    power *= z;
  }
}

}  // namespace

double torsionConstant(const std::vector<SectionSpan>& spans, const Eigen::Vector2d& centroid, double radius) {
  Gram energy = Gram::Zero();
  Column load = Column::Zero();
  double polar = 0;
  Column along, across;
  for (const SectionSpan& span : spans) {
    const double middle = (span.low + span.high) / 2, half = (span.high - span.low) / 2;
    for (const double side : {-kAcross, kAcross}) {
      for (const auto& [point, weight] : kAlong) {
        const Complex z((middle + point * half - centroid.x()) / radius,
                        (span.across + side * span.step / 2 - centroid.y()) / radius);
        const double area = weight * half * span.step / 2;
        gradients(z, along, across);
        energy.noalias() += area * (along * along.transpose() + across * across.transpose());
        load += area * (across * z.real() - along * z.imag());
        polar += area * std::norm(z);
      }
    }
  }
  // Powers are hardly independent on slender sections: a little more energy than they have leaves J an upper bound.
  energy.diagonal().array() += 1e-12 * energy.trace();
  return (polar - load.dot(energy.llt().solve(load))) * radius * radius;
}

}  // namespace medulla
