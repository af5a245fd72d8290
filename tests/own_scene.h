#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/program_run.h"
#include "tests/temporary_folder.h"

namespace medulla {

// A scene of somebody's own, in a folder of theirs: one organ, a tool that presses it. Small and quick.
class OwnScene : public testing::Test {
 protected:
  struct Changes {
    std::string golden = "0.32 0.4", look = "liver", young = "5e3";
    double duration = 0.48;       // s: 12 pictures
    double cameraTarget = -0.05;  // m, x
  };
  void SetUp() override {
    std::filesystem::create_directories(folder / "own");
    folder.write("own/organ.csv",
                 "t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip\n0,-0.0525,-0.0385,0.05,1,0,0,0,0\n0.4,-0.0525,-0.0385,0.019,1,"
                 "0,0,0,0\n");
    write({});
  }
  void write(const Changes& c) const {
    folder.write("own/organ.xml",
                 fmt::format(R"(<scene name="organ"><clock duration="{}"/><dynamics gravity="0 0 0"/>
<tissue name="t" young="{}"/>
<body name="organ" tissue="t" look="{}" model="{}/assets/gallbladder/gallbladder.model.xml"><fix spheres="1"/></body>
<tool name="probe" trajectory="organ.csv"/><camera position="-0.05 -0.045 0.15" target="{} -0.045 0.02"/>
<output size="320 240" fps="25" golden="{}"/></scene>)",
                             c.duration, c.young, c.look, MEDULLA_SOURCE_DIR, c.cameraTarget, c.golden));
  }
  // The program, in the folder.
  ProgramResult run(const std::vector<std::string>& words, ProgramOptions options = {}) const {
    options.folder = folder.path();
    return runProgram(words, options);
  }
  std::string read(const std::string& name) const { return readFile(folder / name); }
  TemporaryFolder folder;
};

// One line on standard error with these words, nothing on standard output.
inline void expectRefused(const ProgramResult& r, const std::string& words, int exitCode = 1) {
  EXPECT_EQ(r.exitCode, exitCode) << r.err;
  EXPECT_EQ(r.out, "");
  EXPECT_EQ(complaints(r).size(), 1) << r.err;
  EXPECT_NE(r.err.find(words), std::string::npos) << "no \"" << words << "\" in " << r.err;
}

}  // namespace medulla
