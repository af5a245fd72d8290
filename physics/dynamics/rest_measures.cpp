#include "physics/dynamics/rest_measures.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "physics/dynamics/identified_mechanics.h"
#include "physics/model/symmetric_eigen.h"

namespace medulla {

using Eigen::Vector3d;

// Of identified links, along the eigenvectors of each one's stiffness.
static std::vector<MeasureRow> identifiedRows(const SoftBodyModel& m, const BodyMechanics& b) {
  std::vector<MeasureRow> rows;
  const int spheres = static_cast<int>(m.spheres.size());
  for (std::size_t k = 0; k < b.identifiedLinks.size(); ++k) {
    const IdentifiedLink& l = m.identified->links[k];
    const RestMeasures measures = restMeasures(m, l);
    const SymmetricEigen eigen = symmetricEigen(b.identifiedLinks[k]);
    for (int i = 0; i < 6; ++i) {
      if (!(eigen.values[i] > 0)) continue;
      const Eigen::Matrix<double, 1, 6> e = eigen.vectors.col(i).transpose();
      rows.push_back({l.frame0, l.frame1 < spheres ? l.frame1 : -1, (e * measures.line).transpose(),
                      (e * measures.turn0).transpose(), (e * measures.turn1).transpose(), eigen.values[i]});
    }
  }
  return rows;
}

static void addRate(int sphere, const Vector6d& rate, StrainRow& row) {
  const auto found = std::find(row.spheres.begin(), row.spheres.end(), sphere);
  if (found != row.spheres.end()) {
    row.rates[found - row.spheres.begin()] += rate;
    return;
  }
  row.spheres.push_back(sphere);
  row.rates.push_back(rate);
}

std::vector<StrainRow> strainRows(const SoftBodyModel& m, const BodyMechanics& b) {
  if (b.identifiedStrains.empty()) return {};
  const int spheres = static_cast<int>(m.spheres.size());
  std::vector<StrainRow> rows(spheres);
  for (std::size_t k = 0; k < b.identifiedStrains.size(); ++k) {
    const IdentifiedLink& l = m.identified->links[k];
    const RestMeasures measures = restMeasures(m, l);
    Matrix6d of0, of1;
    of0 << -measures.line, measures.turn0;
    of1 << measures.line, measures.turn1;
    const auto add = [&](int cell, const Vector6d& strain) {
      addRate(l.frame0, of0.transpose() * strain, rows[cell]);
      if (l.frame1 < spheres) addRate(l.frame1, of1.transpose() * strain, rows[cell]);
    };
    add(l.frame0, b.identifiedStrains[k].at0);
    if (l.frame1 < spheres) add(l.frame1, b.identifiedStrains[k].at1);
  }
  return rows;
}

std::vector<MeasureRow> measureRows(const SoftBodyModel& m, const BodyMechanics& b) {
  if (!b.identifiedLinks.empty()) return identifiedRows(m, b);
  std::vector<MeasureRow> rows;
  const Vector3d none = Vector3d::Zero();
  for (std::size_t k = 0; k < b.spans.size(); ++k) {
    const ElasticLink& l = m.links[k];
    const Vector3d d = b.spans[k].end1 - b.spans[k].end0;
    const Vector3d arm0 = b.spans[k].end0 - m.spheres[l.sphere0].restFrame,
                   arm1 = b.spans[k].end1 - m.spheres[l.sphere1].restFrame;
    const double length = d.norm();
    const LinkStiffness& s = b.links[k];
    const Vector3d t = d / length, u = s.restU, v = t.cross(u);
    const auto add = [&](const Vector3d& line, const Vector3d& turn0, const Vector3d& turn1, double stiffness) {
      rows.push_back({l.sphere0, l.sphere1, line, turn0 - arm0.cross(line), turn1 + arm1.cross(line), stiffness});
    };
    add(t, none, none, s.elongation);
    // k0 a0^2 + 2 c a0 a1 + k1 a1^2 as squares: k0 (a0 + c/k0 a1)^2 + (k1 - c^2/k0) a1^2
    const auto addFlexion = [&](const Vector3d& across, const Vector3d& turn, const FlexionStiffness& f) {
      const double ratio = f.couple / f.end0;
      add((1 + ratio) / length * across, turn, ratio * turn, f.end0);
      add(across / length, none, turn, f.end1 - ratio * f.couple);
    };
    addFlexion(u, -v, s.flexionV);
    addFlexion(v, u, s.flexionU);
    add(none, -t, t, s.torsion);
  }
  return rows;
}

}  // namespace medulla
