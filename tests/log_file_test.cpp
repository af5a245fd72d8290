#include "app/files/log_file.h"

#include <gtest/gtest.h>

#include "app/files/report_file.h"
#include "app/files/surface_file.h"
#include "app/files/text_file.h"
#include "tests/temporary_folder.h"

// What a run and a build leave as text: the log, the surfaces and the report.
namespace medulla {
namespace {

LogRow someRow() {
  LogRow row;
  row.time = 0.1 + 0.2;
  row.tools.resize(1);
  row.tools[0].device = {1, -0.5, 1e-7};
  row.tools[0].proxy = {1. / 3, 0, 0};
  row.tools[0].force = {0, 0, 12345678.9};
  row.tools[0].holding = true;
  row.tools[0].slipped = true;
  row.tools[0].energy = -0.25;
  row.bodies = {{0.99, 235}, {1, 0}};
  row.energies = {1e-3, 2e-3, 5};
  row.impulseMismatch = 0.015;
  return row;
}

TEST(LogFile, ColumnsAreNamedAndNumbersReadBackAsTheSameBits) {
  const TemporaryFolder folder;
  LogFile log(folder / "log.csv", {"grasper"}, {"liver", "bile"});
  log.write(someRow());
  log.commit();
  EXPECT_EQ(
      readTextFile(folder / "log.csv"),
      "t,grasper.device.x,grasper.device.y,grasper.device.z,grasper.proxy.x,grasper.proxy.y,grasper.proxy.z,"
      "grasper.force.x,grasper.force.y,grasper.force.z,grasper.contact,grasper.held,grasper.clamped,grasper.slipped,"
      "grasper.energy,"
      "liver.volume_ratio,liver.dynamic_nodes,bile.volume_ratio,bile.dynamic_nodes,"
      "energy.kinetic,energy.elastic,impulse_mismatch\n"
      "0.30000000000000004,1,-0.5,1e-07,0.3333333333333333,0,0,0,0,12345678.9,0,1,0,1,-0.25,0.99,235,1,0,0.001,0.002,0."
      "015\n");
}

TEST(LogFile, OfARunThatFailedNothingRemains) {
  const TemporaryFolder folder;
  {
    LogFile log(folder / "log.csv", {"grasper"}, {"liver", "bile"});
    log.write(someRow());
  }
  EXPECT_TRUE(folder.contents().empty());
}

// A triangle whose file had six vertices: the second was welded to the first, the third dropped, and the node 2 is new.
std::shared_ptr<SoftBodyModel> mendedModel() {
  auto model = std::make_shared<SoftBodyModel>();
  model->restNodes.resize(3);
  model->nodeOfInputVertex = {-1, 1, 1, -1, 0};
  model->triangles = {{0, 1, 2}};
  return model;
}

TEST(SurfaceFile, KeepsTheVertexOrderOfTheMeshFile) {
  std::vector<BodyDescription> bodies(2);
  bodies[0].name = "first";
  bodies[1].name = "second";
  bodies[0].model = bodies[1].model = mendedModel();
  DynamicsFrame frame;
  frame.bodies.resize(2);
  frame.bodies[0].nodes = {{0, 0, 0}, {0.1, 0, 0}, {0, 1. / 3, 0}};
  frame.bodies[1].nodes = {{2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  EXPECT_EQ(surfaceText(bodies, frame),
            "o first\n"
            "v 0.10000000000000001 0 0\n"  // dropped: where the first kept one is
            "v 0.10000000000000001 0 0\n"
            "v 0.10000000000000001 0 0\n"  // welded
            "v 0.10000000000000001 0 0\n"  // dropped: where the one before it is
            "v 0 0 0\n"
            "v 0 0.33333333333333331 0\n"  // made by the repair
            "f 5 2 6\n"
            "o second\n"
            "v 3 0 0\nv 3 0 0\nv 3 0 0\nv 3 0 0\nv 2 0 0\nv 4 0 0\n"
            "f 11 8 12\n");
}

TEST(ReportFile, HoldsEveryFigureOfABuildWithItsUnit) {
  const TemporaryFolder folder;
  BuildReport report;
  report.triangles = 466;
  report.gapMax = 2.5;
  report.seconds = 0.125;
  writeReport(folder / "r.csv", buildResults(report));
  EXPECT_EQ(readTextFile(folder / "r.csv"),
            "name,value,unit\ntriangles,466,\nskeleton_nodes,0,\nskeleton_links,0,\nvolume,0,m3\ndiagonal,0,m\nspheres,"
            "0,\nlinks,0,\ngap_max,2.5,%\n"
            "gap_mean,0,%\ngap_cones_max,0,%\novershoot_max,0,%\ncover,0,%\ncover_cones,0,%\n"
            "mass_error,0,%\ncentre_error,0,%\ninertia_error,0,%\ncomponents,0,\ncentres_outside,0,\n"
            "attachments_crossing,0,\nattachment_max,0,%\ndegree_max,0,\ndrawn_inside_max,0,%\nseconds,0.125,s\n");
}

}  // namespace
}  // namespace medulla
