#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "app/files/fix_text.h"
#include "app/files/reference_file.h"
#include "app/files/vertex_file.h"
#include "app/simulation.h"
#include "tests/complaint.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

// Static load cases as scenes: what is fixed and loaded where, runs that end at rest, and their refusals.
namespace medulla {
namespace {

// Six vertices of a mesh file: the second was welded to the first, repair dropped the third.
SoftBodyModel repairedModel() {
  SoftBodyModel model;
  model.restNodes.resize(4);
  model.nodeOfInputVertex = {3, 3, -1, 0, 1, 2};
  return model;
}

TEST(VertexFile, VerticesOfTheMeshFileBecomeNodes) {
  const SoftBodyModel model = repairedModel();
  EXPECT_EQ(parseVertices("vertex\n5\n# a comment\n 0 \r\n1\n4", "v.csv", model), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(parseVertices("3", "v.csv", model), std::vector<int>{0});
  DeadLoad whole;
  whole.from = 0.5;
  whole.to = 2;
  for (const char* text :
       {"vertex,fx[N],fy[N],fz[N]\n4,1,2,3\n0,0,0,-1e-3\n1,0,0,-1e-3\n",
        "vertex,fx,fy,fz\n4,1,2,3\n0,0,0,-1e-3\n1,0,0,-1e-3\n", "4,1,2,3\n0,0,0,-1e-3\n1,0,0,-1e-3"}) {
    const std::vector<DeadLoad> loads = parseVertexForces(text, "f.csv", model, whole);
    ASSERT_EQ(loads.size(), 3u);  // those of welded vertices add up
    EXPECT_EQ(loads[0].node, 1);
    EXPECT_EQ(loads[0].force, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(loads[0].from, 0.5);
    EXPECT_EQ(loads[0].to, 2);
    EXPECT_EQ(loads[1].node, 3);
    EXPECT_EQ(loads[2].node, 3);
    EXPECT_EQ(loads[2].force, Eigen::Vector3d(0, 0, -1e-3));
  }
}

TEST(FixText, APartOfSpaceReadsBackAsItWas) {
  SoftBodyModel model;
  model.restNodes = {{0, 0, 0}, {0.1, 0.2, 0.3}};
  const struct {
    Region::Shape shape;
    std::vector<double> numbers;
    const char* text;
  } cases[] = {{Region::Shape::box, {-1e-7, 0, 0, 0.1, 0.2, 1.0 / 3}, "box=-1e-07,0,0,0.1,0.2,0.3333333333333333"},
               {Region::Shape::ball, {0.1, 0.2, 0.3, 1e-9}, "sphere=0.1,0.2,0.3,1e-09"},
               {Region::Shape::halfSpace, {-1, 0, 0, -0.1}, "plane=-1,0,0,-0.1"}};
  for (const auto& c : cases) {
    const Region region = makeRegion(c.shape, c.numbers).value();
    EXPECT_EQ(regionText(region), c.text);
    EXPECT_EQ(parseHeldRegion(c.text, model).nodes, nodesInRegion(model, region)) << c.text;
  }
}

TEST(ReferenceFile, MistakesAreRefusedWithTheLine) {
  SoftBodyModel model;
  model.restNodes.resize(2);
  model.nodeOfInputVertex = {1, -1, 0};
  const auto refusal = [&](const char* text) { return complaintOf([&] { parseReference(text, "r.txt", model); }); };
  EXPECT_EQ(refusal("# unit 1e-3 m\n1 0 0\n2 0 0\n3 0 0\n"), "");
  EXPECT_EQ(parseReference("# unit 1e-3 m\n1 0 0\n2 0 0\n3 0 0\n", "r.txt", model).displacement[0]->x(), 3e-3);
  EXPECT_EQ(refusal("1 0 0\n2 0\n3 0 0\n"), "r.txt:2: 2 words in this row, expected a displacement: x y z");
  EXPECT_EQ(refusal("1 0 0\n2 0 nan\n3 0 0\n"), "r.txt:2: expected a finite number, found 'nan'");
  EXPECT_EQ(refusal("1 0 0\n"), "r.txt: 1 rows, expected one for each of the mesh's 3 vertices");
  EXPECT_EQ(refusal("1 0 0\n1 0 0\n1 0 0\n1 0 0\n"), "r.txt:4: more rows than the mesh has vertices: 3");
  EXPECT_EQ(refusal("0 0 0\n0 0 0\n0 0 0\n"), "r.txt: nothing moves: no error can be stated in % of it");
  EXPECT_EQ(refusal("1 0 0\n# unit 3 mm\n"),
            "r.txt:2: expected # unit NUMBER m, with a number of metres greater than 0");
  EXPECT_EQ(refusal("#Unit 3 mm\n"), "r.txt:1: expected # unit NUMBER m, with a number of metres greater than 0");
  EXPECT_EQ(refusal("# unit 3 m\n# unit 3 m\n"), "r.txt:2: a second unit, expected one for all rows");
  EXPECT_EQ(refusal("# unit -3 m\n"), "r.txt:1: expected # unit NUMBER m, with a number of metres greater than 0");
  EXPECT_THROW(parseReferenceRuns("case 0 1 1 1\n", "r.time"), std::runtime_error);
  EXPECT_THROW(parseReferenceRuns("case 10 1 1\n", "r.time"), std::runtime_error);
}

TEST(VertexFile, MistakesNameTheLine) {
  const SoftBodyModel model = repairedModel();
  const auto vertices = [&](const char* text) { return complaintOf([&] { parseVertices(text, "v.csv", model); }); };
  const auto forces = [&](const char* text) {
    return complaintOf([&] { parseVertexForces(text, "f.csv", model, {}); });
  };
  EXPECT_EQ(complaintOf([] { parseVertices("0\n", "v.csv", {}); }),
            "v.csv: the model does not say which vertices of its mesh its nodes are: build it anew");
  EXPECT_EQ(vertices("0\n6\n"), "v.csv:2: column vertex is '6', expected a whole number from 0 to 5");
  EXPECT_EQ(vertices("-1\n"), "v.csv:1: column vertex is '-1', expected a whole number from 0 to 5");
  EXPECT_EQ(vertices("0\n1.5\n"), "v.csv:2: column vertex is '1.5', expected a whole number from 0 to 5");
  EXPECT_EQ(vertices("0,1\n"), "v.csv:1: 2 columns in this row, expected vertex");
  EXPECT_EQ(vertices("vertices\n0\n"), "v.csv:1: the first row is 'vertices', expected a header vertex or numbers");
  EXPECT_EQ(vertices("vertex\n\n2\n"), "v.csv:3: vertex 2 is none of the surface: repair dropped it from the mesh");
  EXPECT_EQ(vertices("vertex\n"), "v.csv: no rows, expected at least one of vertex");
  EXPECT_EQ(vertices(""), "v.csv: no rows, expected at least one of vertex");
  EXPECT_EQ(forces("# x\n0,0,0,nan\n"), "f.csv:2: column fz[N] is 'nan', expected a finite number");
  EXPECT_EQ(forces("0,1e999,0,0\n"), "f.csv:1: column fx[N] is '1e999', expected a finite number");
  EXPECT_EQ(forces("vertex,fx,fy,fz\n0,0,0\n"), "f.csv:2: 3 columns in this row, expected vertex,fx[N],fy[N],fz[N]");
  EXPECT_EQ(forces("0,0,0,\n"), "f.csv:1: column fz[N] is '', expected a finite number");
  EXPECT_EQ(
      forces("vertex,fx[mN],fy[mN],fz[mN]\n0,1,2,3\n"),
      "f.csv:1: the first row is 'vertex,fx[mN],fy[mN],fz[mN]', expected a header vertex,fx[N],fy[N],fz[N] or numbers");
  EXPECT_EQ(forces("1,0,0,0\n1,0,0,1\n"), "f.csv:2: vertex 1 stands twice");
  EXPECT_EQ(forces("1,0,-2e6,0\n"), "f.csv:1: a force beyond 1e+06 N");
  EXPECT_EQ(forces("7,0,0,0\n"), "f.csv:1: column vertex is '7', expected a whole number from 0 to 5");
}

class LoadCase : public testing::Test {
 protected:
  // The gallbladder without weight, `inside` on its fourth line.
  std::string scene(const std::string& inside, const std::string& duration = "8") const {
    folder.write("case.xml", fmt::format("<scene name='case'><clock duration='{}'/><dynamics gravity='0 0 0'/>\n"
                                         "<tissue name='t' young='5e3' damping='1'/>\n"
                                         "<body name='pear' model='{}/assets/gallbladder/gallbladder.model.xml' "
                                         "tissue='t' look='gallbladder'>\n{}\n</body>\n"
                                         "<camera position='0 0 1' target='0 0 0'/></scene>",
                                         duration, MEDULLA_SOURCE_DIR, inside));
    return folder / "case.xml";
  }
  std::string refusal(const std::string& inside) const {
    const std::string path = scene(inside);
    std::string message = complaintOf([&] { loadScene(readScene(path)); });
    for (std::size_t at; (at = message.find(folder / "")) != std::string::npos;)
      message.erase(at, (folder / "").size());
    return message;
  }
  TemporaryFolder folder;
};

// The upper end, and the lower.
constexpr const char* kHeld = "<fix plane='0 -1 0 0.02'/>";

TEST_F(LoadCase, PartsOfSpaceAndTheirVerticesMeanTheSameNodes) {
  const LoadedScene byPlane = loadScene(
      readScene(scene("<fix plane='0 -1 0 0.02'/><load plane='0 1 0 -0.06' force='0 0 1e-2' from='0.5' to='2'/>")));
  const SceneBody& a = byPlane.scene.bodies[0];
  ASSERT_GT(a.fixedNodes.size(), 10u);
  ASSERT_GT(a.deadLoads.size(), 10u);
  std::string held, loaded;
  for (std::size_t v = 0; v < byPlane.scene.bodies[0].model->nodeOfInputVertex.size(); ++v) {
    const int node = byPlane.scene.bodies[0].model->nodeOfInputVertex[v];
    const double y = byPlane.scene.bodies[0].model->restNodes[node].y();
    if (-y <= 0.02) held += fmt::format("{}\n", v);
    if (y <= -0.06) loaded += fmt::format("{}\n", v);
  }
  folder.write("held.csv", held);
  folder.write("loaded.csv", loaded);
  const LoadedScene byVertex = loadScene(
      readScene(scene("<fix vertices='held.csv'/><load vertices='loaded.csv' force='0 0 1e-2' from='0.5' to='2'/>")));
  const SceneBody& b = byVertex.scene.bodies[0];
  EXPECT_EQ(a.fixedNodes, b.fixedNodes);
  ASSERT_EQ(a.deadLoads.size(), b.deadLoads.size());
  EXPECT_EQ(a.fixed.size(), b.fixed.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < a.deadLoads.size(); ++k) {
    EXPECT_EQ(a.deadLoads[k].node, b.deadLoads[k].node);
    EXPECT_EQ(a.deadLoads[k].force, b.deadLoads[k].force);
    EXPECT_EQ(b.deadLoads[k].from, 0.5);
    EXPECT_EQ(b.deadLoads[k].to, 2);
    sum += a.deadLoads[k].force;
  }
  EXPECT_LT((sum - Eigen::Vector3d(0, 0, 1e-2)).norm(), 1e-15);
}

TEST_F(LoadCase, RegionsHoldTogetherWhatOneOfThemAllHolds) {
  const auto fixed = [&](const std::string& inside) {
    std::vector<FixedSphere> out = loadScene(readScene(scene(inside))).scene.bodies[0].fixed;
    std::sort(out.begin(), out.end(), [](const FixedSphere& a, const FixedSphere& b) { return a.sphere < b.sphere; });
    return out;
  };
  const std::string left = "<fix box='-1 -0.02 -1 X 1 1'/>", right = "<fix box='X -0.02 -1 1 1 1'/>";
  const std::vector<FixedSphere> whole = fixed(kHeld);
  ASSERT_FALSE(whole.empty());
  bool leftHoldsLess = false;
  for (const char* x : {"-0.04", "-0.03", "-0.02"}) {
    const auto at = [x](std::string region) { return region.replace(region.find('X'), 1, x); };
    EXPECT_EQ(fixed(at(left) + at(right)), whole);
    EXPECT_EQ(fixed(at(right) + at(left)), whole);
    leftHoldsLess = leftHoldsLess || fixed(at(left) + "<fix spheres='0'/>").size() < whole.size();
  }
  EXPECT_TRUE(leftHoldsLess);
  // What lets it turn, before or after, takes nothing from what does not.
  std::string turning = kHeld;
  turning.insert(turning.find("/>"), " dof='translation'");
  for (const FixedSphere& f : fixed(turning)) EXPECT_EQ(f.freedom, FixedFreedom::translation);
  EXPECT_EQ(fixed(turning + kHeld), whole);
  EXPECT_EQ(fixed(kHeld + turning), whole);
}

// Of all, or of both halves of the body, or of a half twice the root of it: the same. Of a half alone it is not.
TEST_F(LoadCase, LinksAreSteeredByRegions) {
  const auto hash = [&](const std::string& links) {
    World world = makeWorld(
        loadScene(readScene(scene(kHeld + links + "<load sphere='-0.06 -0.07 0.02 0.03' force='0 0 0.01'/>"))));
    for (int frame = 0; frame < 5; ++frame) world.advance({});
    return world.stateHash();
  };
  const std::string lower = "<links plane='0 1 0 -0.05' flexion='X'/>",
                    upper = "<links plane='0 -1 0 0.05' flexion='X'/>";
  const auto by = [](std::string links, const char* x) { return links.replace(links.find('X'), 1, x); };
  const std::uint64_t whole = hash("<links select='all' flexion='4'/>");
  EXPECT_EQ(hash(by(lower, "4") + by(upper, "4")), whole);
  EXPECT_EQ(hash(by(upper, "2") + by(lower, "4") + by(upper, "2")), whole);
  EXPECT_NE(hash(by(lower, "4")), whole);
  EXPECT_NE(hash(by(upper, "4")), whole);
  EXPECT_NE(hash(by(lower, "4")), hash(by(upper, "4")));
}

TEST_F(LoadCase, MistakesNameFileAndLine) {
  folder.write("far.csv", "vertex\n10\n235\n");
  folder.write("nan.csv", "vertex,fx,fy,fz\n10,0,nan,0\n");
  EXPECT_EQ(refusal("<fix vertices='none.csv'/>"), "case.xml:4: list of vertices \"none.csv\" does not exist");
  const std::string endless(300, 'a');  // what the system does not look for
  EXPECT_EQ(refusal("<fix vertices='" + endless + "'/>"), endless + ": cannot be opened: File name too long");
  EXPECT_EQ(refusal("<fix vertices='far.csv'/>"),
            "far.csv:3: column vertex is '235', expected a whole number from 0 to 234");
  EXPECT_EQ(refusal("<fix plane='0 1 0 -5'/>"), "case.xml:4: no surface node of body \"pear\" lies in here");
  const auto driven = [](int sphere) {
    return fmt::format("<drive sphere='{}' axis='1 0 0' amplitude='0' frequency='1'/>", sphere);
  };
  EXPECT_EQ(refusal("\n<fix spheres='0 99'/>"),
            "case.xml:5: body \"pear\" fixes sphere 99, its model has spheres 0 to 6");
  EXPECT_EQ(refusal("\n" + driven(99)), "case.xml:5: body \"pear\" drives sphere 99, its model has spheres 0 to 6");
  EXPECT_EQ(refusal(kHeld + ("\n" + driven(1))),
            "case.xml:5: body \"pear\" drives sphere 1, which a <fix> of its surface holds: expected one of the two");
  const std::string few = scene("<fix sphere='-0.05 -0.07 0.02 0.012'/>");
  EXPECT_EQ(complaintOf([&] { loadScene(readScene(few)); }), "");
  const std::string noSkin =
      "nothing of body \"pear\" is held in here: its surface is a skin, and no filling sphere has half of its surface "
      "there; expected more of it, or spheres by number";
  EXPECT_EQ(complaintOf([&] {
              loadScene(readScene(few, {{"body.pear.surface", "skin"}}));
            }),
            "--set body.pear.surface: " + noSkin);
  const auto skinWith = [&](const std::string& more) {
    std::string text = readFile(scene(kHeld + ("\n" + more)));
    text.insert(text.find("<body ") + 6, "surface='skin' ");
    folder.write("case.xml", text);
    return complaintOf([&] { loadScene(readScene(folder / "case.xml")); });
  };
  EXPECT_EQ(skinWith(""), "");
  EXPECT_EQ(skinWith("<fix sphere='-0.05 -0.07 0.02 0.012'/>"), few + ":5: " + noSkin);
  EXPECT_EQ(refusal("<load box='5 5 5 6 6 6' force='1 0 0'/>"),
            "case.xml:4: no surface node of body \"pear\" lies in here");
  EXPECT_EQ(refusal("<links box='5 5 5 6 6 6' flexion='2'/>"),
            "case.xml:4: no link of body \"pear\" has its middle in here");
  EXPECT_EQ(refusal("<load vertices='none.csv' force='1 0 0'/>"),
            "case.xml:4: list of vertices \"none.csv\" does not exist");
  EXPECT_EQ(refusal("<load file='none.csv'/>"), "case.xml:4: file of forces \"none.csv\" does not exist");
  EXPECT_EQ(refusal("<load file='nan.csv'/>"), "nan.csv:2: column fy[N] is 'nan', expected a finite number");
  EXPECT_EQ(refusal("<load file='far.csv'/>"),
            "far.csv:1: the first row is 'vertex', expected a header vertex,fx[N],fy[N],fz[N] or numbers");
  folder.write("semicolons.csv", "vertex;fx[N];fy[N];fz[N]\n1;0;0;1\n");
  EXPECT_EQ(refusal("<load file='semicolons.csv'/>"),
            "semicolons.csv:1: columns are separated by semicolons, expected commas");
}

std::vector<Eigen::Vector3d> verticesOf(const std::string& obj) {
  std::vector<Eigen::Vector3d> out;
  std::istringstream lines(readFile(obj));
  for (std::string line; std::getline(lines, line);) {
    Eigen::Vector3d x;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x[0], &x[1], &x[2]) == 3) out.push_back(x);
  }
  return out;
}

// m, of the vertex that has gone farthest between two surfaces.
double farthest(const std::string& from, const std::string& to) {
  const std::vector<Eigen::Vector3d> a = verticesOf(from), b = verticesOf(to);
  EXPECT_EQ(a.size(), b.size());
  double out = 0;
  for (std::size_t k = 0; k < a.size(); ++k) out = std::max(out, (a[k] - b[k]).norm());
  return out;
}

TEST_F(LoadCase, ARunUntilRestEndsWhenNothingMoves) {
  const std::string load = fmt::format("{}<load plane='0 1 0 -0.06' force='0 0 1e-2' to='0.5'/>", kHeld);
  const std::string path = scene(load, "40"), end = folder / "end.obj", later = folder / "later.obj";
  const ProgramResult run = runProgram({"replay", path, "--until-rest", "--surface-at", "end", end, "--surface-at",
                                        "39", later, "--log", folder / "l.csv"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  ASSERT_TRUE(run.out.starts_with("rest_at ")) << run.out;
  const double time = std::stod(run.out.substr(8));
  EXPECT_GT(time, 0.6);
  EXPECT_LT(time, 40);
  EXPECT_EQ(readFile(end), readFile(later));
  // Rest is where a run of twice the time ends, too.
  const std::string longer = folder / "longer.obj", start = folder / "start.obj";
  ASSERT_EQ(runProgram({"replay", path, "--set", fmt::format("clock.duration={}", 2 * time), "--surface-at", "end",
                        longer, "--surface-at", "0", start})
                .exitCode,
            0);
  EXPECT_GT(farthest(start, longer), 1e-3);
  EXPECT_LT(farthest(end, longer), 0.01 * farthest(start, longer));
}

TEST_F(LoadCase, AMomentAfterRestIsThatOfRestAndNoted) {
  const std::string end = folder / "end.obj", late = folder / "late.obj";
  const ProgramResult run = runProgram({"replay", scene(kHeld, "40"), "--until-rest", "--surface-at", "end", end,
                                        "--surface-at", "0", folder / "start.obj", "--surface-at", "39", late});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  ASSERT_EQ(complaints(run).size(), 1) << run.err;
  EXPECT_TRUE(complaints(run)[0].starts_with(fmt::format("note: {} is the shape at rest, at ", late))) << run.err;
  EXPECT_TRUE(complaints(run)[0].ends_with(" s: the run ended before 39 s")) << run.err;
  EXPECT_EQ(readFile(late), readFile(end));
}

// A scene that has been still for less than a swing, though no load acts any more.
TEST_F(LoadCase, ARunThatEndsBeforeRestIsSureSaysSinceWhenItIsStill) {
  const std::string load = fmt::format("{}<load plane='0 1 0 -0.06' force='0 0 1e-3' to='0.1'/>", kHeld);
  const ProgramResult run = runProgram({"replay", scene(load, "40"), "--until-rest"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const double rest = std::stod(run.out.substr(run.out.find("simulated ") + 10));
  const ProgramResult shorter = runProgram({"replay", scene(load, fmt::format("{:.6g}", rest - 0.04)), "--until-rest"});
  EXPECT_EQ(shorter.exitCode, 4);
  ASSERT_EQ(complaints(shorter).size(), 1) << shorter.err;
  double moved = 0, swing = 0, end = 0;
  ASSERT_EQ(std::sscanf(complaints(shorter)[0].c_str(),
                        "medulla: not at rest: body 'pear' moved up to %lf s, expected %lf s of rest, its slowest "
                        "swing, before the end at %lf s",
                        &moved, &swing, &end),
            3)
      << shorter.err;
  EXPECT_NEAR(moved + swing, rest, 0.03);
  EXPECT_NEAR(end, rest - 0.04, 1e-9);
}

TEST_F(LoadCase, ARunThatFindsNoRestSaysSoAndKeepsNothing) {
  const std::string load = fmt::format("{}<load plane='0 1 0 -0.06' force='0 0 1e-2' to='0'/>", kHeld);
  const ProgramResult moving = runProgram({"replay", scene(load, "0.3"), "--until-rest", "--log", folder / "log.csv"});
  EXPECT_EQ(moving.exitCode, 4);
  EXPECT_EQ(moving.out, "");
  EXPECT_TRUE(moving.err.starts_with("medulla: not at rest: body 'pear' moved up to 0.3 s, expected ")) << moving.err;
  EXPECT_EQ(complaints(moving).size(), 1) << moving.err;
  const std::string dropped = "; no file is written, without --until-rest they all are\n";
  EXPECT_TRUE(moving.err.ends_with(dropped)) << moving.err;
  const ProgramResult shape =
      runProgram({"replay", scene(load, "0.3"), "--until-rest", "--surface-at", "end", folder / "end.obj"});
  EXPECT_EQ(shape.exitCode, 4);
  EXPECT_TRUE(shape.err.ends_with(dropped)) << shape.err;
  EXPECT_TRUE(runProgram({"replay", scene(load, "0.3"), "--until-rest"}).err.ends_with("the end at 0.3 s\n"));
  EXPECT_EQ(folder.contents(), std::vector<std::string>{"case.xml"});
  // Still, but with a load to come.
  const std::string later = fmt::format("{}<load plane='0 1 0 -0.06' force='0 0 1e-2' from='1' to='2'/>", kHeld);
  EXPECT_EQ(runProgram({"replay", scene(later, "0.9"), "--until-rest"}).exitCode, 4);
  EXPECT_EQ(runProgram({"replay", scene(kHeld, "0.9"), "--until-rest"}).exitCode, 0);
}

// Slow enough that no node moves by as much as counts from frame to frame.
TEST_F(LoadCase, ADrivenBodyIsNeverAtRest) {
  const auto until = [&](const std::string& motion) {
    const std::string drive = fmt::format("<drive sphere='0' axis='1 0 0' frequency='1e-3' {}/>", motion);
    return runProgram({"replay", scene(drive, "4"), "--set", "dynamics.gravity=0 0 0", "--until-rest"});
  };
  for (const char* motion : {"amplitude='1e-3'", "amplitude='0' velocity='1e-9 0 0'"}) {
    const ProgramResult run = until(motion);
    EXPECT_EQ(run.exitCode, 4) << run.out;
    EXPECT_EQ(complaints(run), std::vector<std::string>{"medulla: never at rest: sphere 0 of body 'pear' is driven all "
                                                        "the time, expected a run without --until-rest"});
  }
  EXPECT_EQ(until("amplitude='0'").exitCode, 0);
}

// Of several that hold a sphere the one that lets it turn least counts.
TEST_F(LoadCase, APartThatHoldsAllHoldsItsSpheresFromTurning) {
  const auto freedoms = [&](const std::string& fixes) {
    std::map<int, FixedFreedom> out;
    const LoadedScene loaded = loadScene(readScene(scene(fixes)));
    for (const FixedSphere& fixed : loaded.scene.bodies[0].fixed) out[fixed.sphere] = fixed.freedom;
    return out;
  };
  const std::string turning = "<fix plane='0 -1 0 0.02' dof='translation'/>";
  const auto held = freedoms(kHeld), loose = freedoms(turning);
  ASSERT_FALSE(held.empty());
  for (const auto& [sphere, freedom] : held) EXPECT_EQ(freedom, FixedFreedom::all) << sphere;
  for (const auto& [sphere, freedom] : loose) EXPECT_EQ(freedom, FixedFreedom::translation) << sphere;
  EXPECT_EQ(freedoms(turning + kHeld), held);
  const std::string byNumber = fmt::format("<fix spheres='{}' dof='translation'/>", held.begin()->first);
  EXPECT_EQ(freedoms(byNumber + kHeld), held);
}

// A tool that comes late is waited for, where nothing moves before.
TEST_F(LoadCase, ARunUntilRestWaitsForItsTools) {
  std::string text = readFile(scene(kHeld, "2"));
  folder.write("case.xml", text.insert(text.find("<camera"), "<tool name='probe' trajectory='motion.csv'/>"));
  folder.write("motion.csv",
               "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,0.5,0.5,0.5,1,0,0,0,0\n0.9,0.5,0.5,0.5,1,0,0,0,0\n"
               "1.2,0.6,0.5,0.5,1,0,0,0,0\n");
  const ProgramResult run = runProgram({"replay", folder / "case.xml", "--until-rest"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_GT(std::stod(run.out.substr(run.out.find("rest_at ") + 8)), 1.199);
}

// Of ticks of 1/1200 s the one at 0.58 s is recorded at 0.5800000000000001 s, past the end of its frame.
TEST_F(LoadCase, ARecordRestsWhenItsRunDid) {
  std::string text = readFile(scene(kHeld, "2"));
  folder.write("case.xml", text.insert(text.find("<camera"), "<tool name='probe' trajectory='motion.csv'/>"));
  folder.write("motion.csv",
               "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,0.5,0.5,0.5,1,0,0,0,0\n0.58,0.6,0.5,0.5,1,0,0,0,0\n");
  const std::string path = folder / "case.xml", record = folder / "record.csv";
  const ProgramResult run = runProgram({"replay", path, "--until-rest", "--record", record});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NE(readFile(record).find("\n0,0.5,"), std::string::npos) << "where it began";
  EXPECT_NE(readFile(record).find("\n0.5800000000000001,"), std::string::npos);
  const ProgramResult again = runProgram({"replay", path, "--until-rest", "--trajectory", record});
  for (const char* result : {"rest_at", "hash"})
    EXPECT_EQ(again.out.substr(again.out.find(result), 20), run.out.substr(run.out.find(result), 20)) << result;
}

}  // namespace
}  // namespace medulla
