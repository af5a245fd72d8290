#include "app/starter_scene.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>

#include "app/files/report_file.h"
#include "physics/dynamics/rest_modes.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/rotation_between.h"
#include "physics/model/surface_queries.h"

namespace medulla {

namespace {

using Eigen::Vector3d;

// Where things are on the body; everything else follows from these and from its size.
struct Layout {
  Eigen::AlignedBox3d box;
  double size = 0;   // m, the box's diagonal
  double grain = 0;  // m, what the tool's own size and ways go by: `size`, on a thin body what its thickness asks for
  int axis = 0;      // of the box's longest side
  int view = 2;      // along which the camera looks, from the positive side: z, or x across a body that is long in z
  double held = 0;   // -1 or 1: which end along the axis
  Vector3d touch = Vector3d::Zero(), normal = Vector3d::UnitZ();
};

Vector3d towardsCamera(const Layout& l) {
  return Vector3d::Unit(l.view);
}

Vector3d rightOf(const Layout& l) {
  return Vector3d::UnitY().cross(towardsCamera(l));
}

struct SurfacePoint {
  Vector3d at, normal;
};

// Its nodes, and the middles of triangles that are large: the nodes of a box of twelve triangles are corners, off which
// a tool slides, and which are drawn rounded far behind it.
std::vector<SurfacePoint> touchablePoints(const SoftBodyModel& m, double size) {
  constexpr double kLarge = 0.2;  // of the body, a triangle's longest edge
  std::vector<SurfacePoint> points;
  const TriangleMesh mesh{m.restNodes, m.triangles};
  const std::vector<Vector3d> normals = vertexNormals(mesh);
  for (std::size_t i = 0; i < normals.size(); ++i) points.push_back({m.restNodes[i], normals[i]});
  for (const std::array<int, 3>& t : m.triangles)
    if (longestEdge(mesh, t) > kLarge * size) points.push_back({centroid(mesh, t), areaVector(mesh, t).normalized()});
  return points;
}

// Towards the free end, facing the camera best.
SurfacePoint touchedPoint(const SoftBodyModel& m, const Layout& l) {
  Vector3d wanted = l.box.center();
  wanted[l.axis] -= 0.15 * l.held * l.box.sizes()[l.axis];
  wanted[l.view] = l.box.max()[l.view];
  const auto distance = [&](const SurfacePoint& p) {
    const double turnedAway = l.size * (1 - p.normal[l.view]);
    return (p.at - wanted).norm() + turnedAway;
  };
  const std::vector<SurfacePoint> points = touchablePoints(m, l.size);
  return *std::min_element(points.begin(), points.end(),
                           [&](const SurfacePoint& a, const SurfacePoint& b) { return distance(a) < distance(b); });
}

// How far towards an end of the longest axis, in box lengths from the middle: 0.5 at the very end.
double towards(const Layout& l, double end, const FillingSphere& s) {
  return end * (s.restBallCentre - l.box.center())[l.axis] / l.box.sizes()[l.axis];
}

constexpr double kOuterQuarter = 0.25;

double volumeBeyond(const SoftBodyModel& m, const Layout& l, double end) {
  double volume = 0;
  for (const FillingSphere& s : m.spheres) volume += towards(l, end, s) > kOuterQuarter ? s.volume : 0;
  return volume;
}

// On a tube or a plate of a hundredth of its length a tool made for its length would close far behind it. So at most
// 0.08 kThicknesses, two thirds of the thickness, lie between where the grip touches and where it has closed.
constexpr double kThicknesses = 8;

// Of the sphere there what lies inside: of a thin body's most may stick out.
double thicknessAt(const SoftBodyModel& m, const Vector3d& point) {
  const auto distance = [&](const FillingSphere& s) { return (s.restBallCentre - point).norm() - s.radius; };
  const auto nearest =
      std::min_element(m.spheres.begin(), m.spheres.end(),
                       [&](const FillingSphere& a, const FillingSphere& b) { return distance(a) < distance(b); });
  const SurfaceTree surface = makeSurfaceTree({m.restNodes, m.triangles});
  return 2 * std::min(nearest->radius, closestPoint(surface, nearest->restBallCentre).distance);
}

// Held at the upper end where the body stands, otherwise at the bulkier one: a tail would not hold it.
Layout layOutScene(const SoftBodyModel& m) {
  Layout l;
  l.box = boundsOf(m.restNodes);
  l.size = l.box.diagonal().norm();
  l.box.sizes().maxCoeff(&l.axis);
  l.view = l.axis == 2 ? 0 : 2;
  l.held = l.axis == 1 || volumeBeyond(m, l, 1) > volumeBeyond(m, l, -1) ? 1 : -1;
  const SurfacePoint touched = touchedPoint(m, l);
  l.touch = touched.at;
  l.normal = touched.normal;
  l.grain = std::min(l.size, kThicknesses * thicknessAt(m, l.touch));
  return l;
}

// The spheres in the outer quarter of the held end, or the two outermost: of a body that hangs on a single sphere, by
// links that are thin there, the rest swings so slowly (0.03 to 0.2 Hz) that one touch knocks it out of the tool's way.
// One sphere stays free.
std::vector<int> heldSpheres(const SoftBodyModel& m, const Layout& l) {
  const int count = static_cast<int>(m.spheres.size());
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](int i) { return towards(l, l.held, m.spheres[i]); };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return place(a) > place(b); });
  const auto outer = std::count_if(order.begin(), order.end(), [&](int i) { return place(i) > kOuterQuarter; });
  order.resize(std::max(static_cast<int>(outer), std::clamp(count - 1, 1, 2)));
  std::sort(order.begin(), order.end());
  return order;
}

std::string numbersText(const std::vector<int>& numbers) {
  std::string out;
  for (const int i : numbers) out += fmt::format("{}{}", out.empty() ? "" : " ", i);
  return out;
}

BodyDescription heldBody(const SoftBodyModel& m, const std::vector<int>& held, const Tissue& tissue) {
  BodyDescription body;
  body.model = std::shared_ptr<const SoftBodyModel>(std::shared_ptr<const SoftBodyModel>(), &m);
  body.tissue = tissue;
  for (const int sphere : held) body.fixed.push_back({sphere});
  return body;
}

// How many times stiffer the tissue has to be for what hangs on these spheres to swing back between a press and a grab:
// stiffness grows with the square of the frequency. 1 where nothing swings; a thread stays a limp one.
double stiffening(const SoftBodyModel& m, const std::vector<int>& held, const Tissue& tissue) {
  constexpr double kSlowest = 0.25, kMost = 10;  // Hz; at 0.13 Hz bodies were still away when the tool came back
  const BodyDescription body = heldBody(m, held, tissue);
  const double frequency = lowestFrequency(body, bodyMechanics(body)) / (2 * std::numbers::pi);
  return frequency > 0 ? std::clamp(std::pow(kSlowest / frequency, 2), 1.0, kMost) : 1;
}

// Of a thin sheet's cells explicit steps are so short that implicit ones are many times as fast.
bool runsInImplicitSteps(const SoftBodyModel& m, const std::vector<int>& held, const Tissue& tissue) {
  constexpr double kShortest = 1e-5;  // s
  return explicitLimit(heldBody(m, held, tissue)) < kShortest;
}

std::string sceneText(const std::string& name, const SoftBodyModel& model, const Layout& l) {
  // A body ten times as long of the same tissue would hang limp: stiffness grows with size, as in structures of one
  // shape that sag alike. Couplings and force limit follow.
  const double scale = l.size / 0.1;
  const std::vector<int> held = heldSpheres(model, l);
  Tissue tissue{.young = 5e3 * scale, .poisson = 0.45, .density = 1040, .damping = 0.4};
  const double stiffer = stiffening(model, held, tissue);
  tissue.young *= stiffer;
  constexpr double fov = 42, aspect = 16.0 / 9;
  const Vector3d half = 0.5 * l.box.sizes(), centre = l.box.center(), toCamera = towardsCamera(l), right = rightOf(l);
  const auto along = [&half](const Vector3d& axis) { return half.dot(axis.cwiseAbs()); };
  const double halfHeight = 1.2 * std::max(half.y(), along(right) / aspect);
  const double distance = along(toCamera) + halfHeight / std::tan(0.5 * fov * std::numbers::pi / 180);
  std::string out =
      fmt::format("<!-- {} with a tool that presses, grabs, pulls and twists it. SI units; y up. -->\n", name);
  out += fmt::format("<scene name=\"{}\">\n", name);
  out += "  <clock servo=\"1200\" dynamics=\"50\" duration=\"9\"/>\n";
  out += "  <!-- the mesh is taken as the shape under weight; for free fall: gravity=\"0 -9.81 0\" -->\n";
  const bool implicit = runsInImplicitSteps(model, held, tissue);
  if (implicit) out += "  <!-- implicit: its cells are so thin that explicit steps would be shorter than 10 us -->\n";
  out += fmt::format("  <dynamics gravity=\"0 0 0\"{}/>\n", implicit ? " integrator=\"implicit\"" : "");
  if (stiffer > 1)
    out += fmt::format(
        "  <!-- {:.2g} times as stiff as its size asks for: so little holds the body that it swung too slowly -->\n",
        stiffer);
  out += fmt::format("  <tissue name=\"soft\" young=\"{:.3g}\" poisson=\"{}\" density=\"{}\" damping=\"{}\"/>\n",
                     tissue.young, tissue.poisson, tissue.density, tissue.damping);
  out += fmt::format("  <body name=\"{0}\" model=\"{0}.model.xml\" tissue=\"soft\" look=\"stomach\">\n", name);
  out += "    <!-- numbers of filling spheres; the model view shows the held ones grey -->\n";
  out += fmt::format("    <fix spheres=\"{}\"/>\n  </body>\n", numbersText(held));
  out += "  <!-- what it lies before; a mesh of yours is shape=\"mesh\" mesh=\"FILE\" -->\n";
  out += fmt::format("  <static shape=\"plane\" position=\"{}\" normal=\"{}\" look=\"wall\" contact=\"false\"/>\n",
                     vectorText(centre - (along(toCamera) + 0.15 * l.size) * toCamera), vectorText(toCamera));
  // Three times as stiff as what the tool touches, at its size: as organs' scenes have it.
  out += fmt::format(
      "  <tool name=\"{}\" trajectory=\"{}.csv\" radius=\"{:.3g}\" stiffness=\"{:.3g}\" damping=\"{:.3g}\" "
      "friction=\"0.3 0.2\"\n        force_max=\"{:.3g}\" grip_force_max=\"{:.3g}\" "
      "grip_radius=\"{:.3g}\"/>\n",
      name == "grasper" ? "tool" : "grasper", name, 0.03 * l.grain, 0.2 * tissue.young * l.size,
      0.4 * std::sqrt(stiffer) * std::pow(scale, 2.5), stiffer * 8 * std::pow(scale, 3),
      stiffer * 8 * std::pow(scale, 3), 0.08 * l.grain);
  out += fmt::format("  <camera position=\"{}\" target=\"{}\" fov=\"{}\"/>\n", vectorText(centre + distance * toCamera),
                     vectorText(centre), fov);
  out += fmt::format("  <light offset=\"{}\" reference_distance=\"{:.3g}\"/>\n",
                     vectorText(distance * (0.12 * Vector3d::UnitY() - 0.1 * right)), distance);
  out += "  <output size=\"1280 720\" fps=\"30\" golden=\"0 2.2 5.5\"/>\n</scene>\n";
  return out;
}

std::string trajectoryText(const Layout& l) {
  // It comes in from above the free end, of a body that stands from the upper right, and half aside: straight from the
  // camera it would hide what it does.
  const Vector3d aside = l.axis == 1 ? rightOf(l) : Vector3d(-l.held * Vector3d::Unit(l.axis));
  const Vector3d shaft = (0.8 * l.normal + 0.65 * aside + 0.45 * Vector3d::UnitY()).normalized();
  const Eigen::Quaterniond straight = rotationBetween(Vector3d::UnitZ(), shaft);
  const Eigen::Quaterniond twisted = straight * Eigen::AngleAxisd(1.2, Vector3d::UnitZ());
  Vector3d sideways = Vector3d::Zero();
  sideways[l.axis] = -l.held;
  const Vector3d pulled = l.touch + 0.2 * l.size * (0.8 * l.normal + 0.6 * sideways).normalized();
  std::string out =
      "# Key poses; the tool moves smoothly through them. grip above 0.5 holds what is touched.\n"
      "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n";
  const auto key = [&](double t, const Vector3d& x, const Eigen::Quaterniond& q, double grip) {
    out += fmt::format("{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{}\n", t, x.x(), x.y(), x.z(), q.w(), q.x(),
                       q.y(), q.z(), grip);
  };
  const auto above = [&](double share) -> Vector3d { return l.touch + share * l.grain * l.normal; };
  const Vector3d far = l.touch + 0.4 * l.size * l.normal;
  out += "# approach\n";
  key(0, far, straight, 0);
  key(1, above(0.06), straight, 1);
  out += "# press and hold; jaws that closed in the air hold nothing\n";
  key(1.8, above(-0.05), straight, 1);
  key(2.4, above(-0.05), straight, 1);
  out += "# back, open, touch, grab\n";
  key(3.1, above(0.05), straight, 1);
  key(3.8, above(0), straight, 0);
  key(4.2, above(-0.08), straight, 1);  // on its way in as it closes: a body that swings freely is touched then
  out += "# pull\n";
  key(5.2, pulled, straight, 1);
  key(5.6, pulled, straight, 1);
  out += "# twist\n";
  key(6.4, pulled, twisted, 1);
  key(6.7, pulled, twisted, 1);
  out += "# let go and leave\n";
  key(6.8, pulled, twisted, 0);
  key(8, far, straight, 0);
  return out;
}

}  // namespace

StarterScene starterScene(const std::string& name, const SoftBodyModel& model) {
  const Layout layout = layOutScene(model);
  return {sceneText(name, model, layout), trajectoryText(layout)};
}

}  // namespace medulla
