#pragma once

#include <Eigen/Core>
#include <functional>

// Building blocks of the organ shapes: signed distance functions, negative inside, in millimetres (anatomy is quoted in
// them). They are first-order distances: right near the surface, a bound elsewhere. Only + - * / sqrt and floor are
// used, which IEEE 754 defines to the last bit: the meshes come out the same on every machine, whatever its libm.
namespace medulla {

using SignedDistance = std::function<double(const Eigen::Vector3d&)>;

struct Box {
  Eigen::Vector3d low, high;  // mm
};

// Smooth union and intersection (Quilez 2013, quadratic): differ from min and max only where |a - b| < blend (mm).
double smoothMin(double a, double b, double blend);
double smoothMax(double a, double b, double blend);

// 0 below `from`, 1 above `to`, cubic between.
double smoothStep(double from, double to, double x);

double ellipsoid(const Eigen::Vector3d& p, const Eigen::Vector3d& centre, const Eigen::Vector3d& radii);

// Union of the balls between two of different size; exact outside.
double roundCone(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radiusA,
                 double radiusB);

// Smooth value noise, -0.5..0.5, features of about `size` mm.
double noise(const Eigen::Vector3d& p, double size);

// Central differences over +-0.25 mm: small against every feature, large against the kinks of sampled tubes.
Eigen::Vector3d gradient(const SignedDistance& sdf, const Eigen::Vector3d& p);
Eigen::Vector3d normalAt(const SignedDistance& sdf, const Eigen::Vector3d& p);

// Newton steps along the gradient to the zero set, together no farther than about `reach` mm each.
Eigen::Vector3d projectToSurface(const SignedDistance& sdf, Eigen::Vector3d p, double reach);

}  // namespace medulla
