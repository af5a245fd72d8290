#include "tests/own_scene.h"

// What users hand the program by mistake: one line, the exit code, nothing written and nothing harmed.
namespace medulla {
namespace {

class BadInput : public OwnScene {
 protected:
  // The scene with one more element, in its first line.
  void add(const std::string& element) const {
    std::string text = read("own/organ.xml");
    folder.write("own/organ.xml", text.insert(text.find('\n'), element));
  }
};

TEST_F(BadInput, AStaticMeshBeyondWhatCanBeDrawnIsRefused) {
  folder.write("own/far.obj", "v 1e39 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
  add("<static shape='mesh' mesh='far.obj' look='wall'/>");
  expectRefused(run({"check", "own/organ.xml"}),
                "own/organ.xml:1: own/far.obj reaches 1e+39 m from its origin, expected at most 1000 m");
}

TEST_F(BadInput, AMeshThatIsFarTooLargeIsRefusedInOneLine) {
  folder.write("m.obj", "v 1e7 0 0\nv 0 1e7 0\nv 0 0 1e7\nv 0 0 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n");
  expectRefused(run({"build", "m.obj", "-o", "m.xml"}), "is the unit right?");
}

}  // namespace
}  // namespace medulla
