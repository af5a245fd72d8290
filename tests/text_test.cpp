#include <gtest/gtest.h>

#include "app/files/text.h"

namespace medulla {

TEST(Text, WordsInMessagesAreShortAndOnOneLine) {
  EXPECT_EQ(inQuotes("word"), "'word'");
  EXPECT_EQ(inQuotes("word", '"'), "\"word\"");
  EXPECT_EQ(inQuotes("two\nlines\x1b[31m\x7f"), "'two lines?[31m?'");
  EXPECT_EQ(inQuotes(std::string(1000, 'a')), "'" + std::string(60, 'a') + "...'");
  EXPECT_EQ(inQuotes(std::string(59, 'a') + "\u00e9" + "b"), "'" + std::string(59, 'a') + "...'");  // not half a letter
}

TEST(Text, WordsThatResembleNothingAreToldWhatThereIs) {
  const std::vector<std::string> units = {"m", "mm", "inch"};
  EXPECT_EQ(nearestName("Mm", units), "mm");
  EXPECT_EQ(hintOfNames("Mm", units), "did you mean \"mm\"?");
  EXPECT_EQ(hintOfNames("colour", {"name", "look"}), "expected one of name, look");
  EXPECT_EQ(hintOfNames("colour", {}), "");
  EXPECT_EQ(hintOfNames("unit", {std::string(8'000'000, 'x')}).size(),
            hintOfNames("unit", {std::string(99, 'x')}).size());
  EXPECT_EQ(hintOfNames("q", std::vector<std::string>(31, "a\nb")).substr(0, 22), "expected one of a b, a");
  EXPECT_TRUE(hintOfNames("q", std::vector<std::string>(31, "a\nb")).ends_with("a b, ..."));
  EXPECT_EQ(hintAndNames("Mm", units), "did you mean \"mm\"? known: m, mm, inch");
  EXPECT_EQ(hintAndNames("colour", {"name", "look"}), "expected one of name, look");
}

TEST(Text, AShellTakesItForOneWord) {
  EXPECT_EQ(shellWord("../scenes/liver-2_b.xml"), "../scenes/liver-2_b.xml");
  EXPECT_EQ(shellWord("plane=0,-1,0,1.5e-05"), "plane=0,-1,0,1.5e-05");
  EXPECT_EQ(shellWord("my organ.obj"), "'my organ.obj'");
  EXPECT_EQ(shellWord("a;b"), "'a;b'");
  EXPECT_EQ(shellWord("it's"), "'it'\\''s'");
  EXPECT_EQ(shellWord(""), "''");
}

}  // namespace medulla
