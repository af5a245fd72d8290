#include <fmt/format.h>
#include <gtest/gtest.h>

#include <vector>

#include "tests/own_scene.h"

// When a scene's captions are in the picture.
namespace medulla {
namespace {

class CaptionTimes : public OwnScene {
 protected:
  // Ten pictures, 40 ms apart, of the scene with these captions alone.
  std::vector<std::string> pictures(const std::string& captions) const {
    write({});
    std::string text = read("own/organ.xml");
    const std::string end = "/></scene>";
    folder.write("own/organ.xml", text.replace(text.rfind(end), end.size(), ">" + captions + "</output></scene>"));
    const ProgramResult r = run({"render", "own/organ.xml", "--frames", "0:10", "--size", "320x240", "--quality",
                                 "draft", "--show", "caption", "-o", "frames"});
    EXPECT_EQ(r.exitCode, 0) << r.err;
    std::vector<std::string> out(10);
    for (int k = 0; k < 10; ++k) out[k] = read(fmt::format("frames/{:05}.png", k));
    return out;
  }
};

TEST_F(CaptionTimes, ACaptionIsThereFromItsFirstTimeUntilItsLast) {
  const std::string first = R"(<caption from="0.12" to="0.2" text="pressed"/>)",
                    second = R"(<caption from="0.2" to="0.32" text="held"/>)";
  const std::vector<std::string> none = pictures(""), one = pictures(first), other = pictures(second),
                                 both = pictures(first + second);
  for (int k = 0; k < 10; ++k) {
    const bool inFirst = k >= 3 && k < 5, inSecond = k >= 5 && k < 8;
    EXPECT_GT(none[k].size(), 1000u) << k;
    EXPECT_EQ(one[k] != none[k], inFirst) << k;
    EXPECT_EQ(other[k] != none[k], inSecond) << k;
    EXPECT_TRUE(both[k] == (inFirst ? one[k] : inSecond ? other[k] : none[k])) << k;
  }
}

}  // namespace
}  // namespace medulla
