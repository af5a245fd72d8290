#include "app/torture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "app/files/trial_journal.h"
#include "tests/complaint.h"
#include "tests/file_size_limit.h"
#include "tests/identified_model.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

// Stability where methods fail: trials in the library, `medulla stability` around them.
namespace medulla {
namespace {

BodyDescription heldTube() {
  BodyDescription body = synthetic::body(synthetic::chainModel(synthetic::straightTube(5, 0.08, 0.012, 6, 8)), 6e3);
  body.tissue.damping = 0.4;
  body.fixed = {{0, FixedFreedom::all}};
  return body;
}

// The same of an identified network, held by its patch.
BodyDescription identifiedTube() {
  const auto tube = synthetic::chainModel(synthetic::straightTube(5, 0.08, 0.012, 6, 8));
  synthetic::NetworkSettings settings;
  settings.uneven = 0.1;
  for (int i = 0; i < 9; ++i) settings.held.push_back(i);
  BodyDescription body = synthetic::identifiedBody(synthetic::withNetwork(*tube, settings), 6e3);
  body.tissue.damping = 0.4;
  return body;
}

// Identified as one of beams: nothing but what says so.
BodyDescription tubeThatKeepsFormulas() {
  BodyDescription body = heldTube();
  auto model = std::make_shared<SoftBodyModel>(*body.model);
  auto network = std::make_shared<IdentifiedNetwork>();
  network->usesFormulas = true;
  model->identified = network;
  body.model = model;
  return body;
}

class Torture : public testing::TestWithParam<std::string> {};

// The whole set at the steps where explicit methods have long failed.
void expectSurvival(const BodyDescription& body, const std::string& trial) {
  for (const TortureMethod& method : tortureMethods()) {
    if (method.integrator != Integrator::implicit) continue;
    for (const double step : {0.01, 0.05}) {
      const TortureOutcome outcome = torture(body, method, trial, step);
      EXPECT_TRUE(outcome.survived) << method.name << ' ' << step;
      EXPECT_TRUE(outcome.recoveredAt) << method.name << ' ' << step;
      EXPECT_LE(outcome.largestEnergy, (method.order == 1 ? 1 + 1e-12 : 1.5) * outcome.startEnergy)
          << method.name << ' ' << step;
    }
  }
}

TEST_P(Torture, ImplicitStepsSurviveAndComeBackToRest) {
  expectSurvival(heldTube(), GetParam());
}
TEST_P(Torture, OfIdentifiedLinksLikewise) {
  expectSurvival(identifiedTube(), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Trials, Torture, testing::ValuesIn(tortureTrials()), [](const auto& trial) {
  std::string name = trial.param;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return name;
});

TEST(TortureOfExplicitSteps, FailsBeyondTheLimitAndSaysSo) {
  const BodyDescription body = heldTube();
  const TortureMethod& method = tortureMethods()[0];
  ASSERT_EQ(method.integrator, Integrator::explicitEuler);
  const double limit = tortureLimit(body);
  EXPECT_TRUE(torture(body, method, "stiffness_1", 0.5 * limit).recoveredAt);
  const TortureOutcome failed = torture(body, method, "stiffness_1", 4 * limit);
  EXPECT_FALSE(failed.survived);
  EXPECT_FALSE(failed.recoveredAt);
  EXPECT_GT(failed.largestEnergy, failed.startEnergy);
}

// A hand gives energy as long as it acts: nothing is measured, or at rest, before it has let go.
TEST(TortureOfExplicitSteps, HandsCountFromWhereTheyLetGo) {
  const BodyDescription body = heldTube();
  const TortureOutcome failed = torture(body, tortureMethods()[0], "hand_step", 4 * tortureLimit(body));
  EXPECT_FALSE(failed.survived);
  EXPECT_GT(failed.largestEnergy, failed.startEnergy);
  BodyDescription hard = body;
  hard.tissue.young *= 1e4;
  const TortureOutcome stiff = torture(hard, tortureMethods()[1], "hand_step", 0.01);
  ASSERT_TRUE(stiff.recoveredAt);
  EXPECT_GE(*stiff.recoveredAt, 1);
}

TEST(TortureOfExplicitSteps, OfAModelThatKeepsTheFormulasLikewise) {
  for (const char* trial : {"shuffled", "scale_0.1", "scale_10"})
    EXPECT_TRUE(torture(tubeThatKeepsFormulas(), tortureMethods()[0], trial, 1e-4).survived) << trial;
}

// A part of space that holds all links holds them at any scale.
TEST(TortureOfExplicitSteps, LinksThatAreSteeredGrowWithTheBody) {
  Region all;
  all.shape = Region::Shape::halfSpace;
  all.distance = 0.1;
  for (const char* trial : {"scale_0.1", "scale_10"}) {
    BodyDescription body = heldTube();
    body.steered = {{{1, 50, 1}, {}}};
    const double everywhere = tortureSteps(body, trial, 1e-4);
    body.steered[0].where = all;
    EXPECT_EQ(tortureSteps(body, trial, 1e-4), everywhere) << trial;
  }
}

TEST(TortureOfExplicitSteps, UnknownTrialsAndFreeBodiesAreRefused) {
  EXPECT_THROW(torture(heldTube(), tortureMethods()[0], "tickled", 0.01), std::runtime_error);
  BodyDescription body = heldTube();
  body.fixed.clear();
  EXPECT_THROW(torture(body, tortureMethods()[0], "random", 0.01), std::runtime_error);
}

TEST(StabilityCommand, WritesMapAndTrials) {
  const TemporaryFolder folder;
  const std::string scene = std::string(MEDULLA_SOURCE_DIR) + "/scenes/gallbladder.xml";
  const ProgramResult result = runProgram(
      {"stability", scene, "-o", folder / "out", "--steps", "10,50", "--young", "1e4,1e6", "--trial-steps", "50"});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.out.find("implicit.map_recovered 4/4"), std::string::npos) << result.out;
  const std::string map = readFile(folder / "out/map.csv"), trials = readFile(folder / "out/trials.csv");
  EXPECT_EQ(std::count(map.begin(), map.end(), '\n'), 1 + 3 * 4);
  EXPECT_EQ(std::count(trials.begin(), trials.end(), '\n'), 1 + 3 * static_cast<long>(tortureTrials().size()));
  EXPECT_NE(map.find("explicit,,10000,0.05,0,"), std::string::npos) << map;
  const ProgramResult again = runProgram({"stability", scene, "-o", folder / "out", "--steps", "10", "--young", "1e4",
                                          "--trial-steps", "50", "--methods", "explicit"});
  ASSERT_EQ(complaints(again).size(), 1) << again.err;
  EXPECT_NE(
      again.err.find("out/trials.csv holds trials of implicit, implicit_2, which those of this call will replace"),
      std::string::npos)
      << again.err;
}

// Rows are on the disk as they are known; the command that was interrupted goes on from there, to the same tables.
TEST(StabilityCommand, AnInterruptedRunIsTakenUpAgain) {
  const TemporaryFolder folder;
  const auto words = [&](const std::string& out) -> std::vector<std::string> {
    return {"stability",
            std::string(MEDULLA_SOURCE_DIR) + "/scenes/gallbladder.xml",
            "-o",
            folder / out,
            "--methods",
            "implicit",
            "--steps",
            "50,10",
            "--young",
            "1e4",
            "--trial-steps",
            "50",
            "--threads",
            "2"};
  };
  const std::string journal = folder / "out/trials.part";
  ProgramOptions interrupted;
  interrupted.interruptWhen = [&] {
    const std::string text = readFile(journal);
    return std::count(text.begin(), text.end(), '\n') >= 3;
  };
  const ProgramResult first = runProgram(words("out"), interrupted);
  ASSERT_EQ(first.exitCode, 130) << first.err;
  EXPECT_NE(first.err.find("the same command goes on from there"), std::string::npos) << first.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out/map.csv"));
  // A process that is killed may leave part of a row.
  const std::string kept = readFile(journal);
  // Another choice of trials in between harms none of it.
  std::vector<std::string> other = words("out");
  other[7] = other[11] = "20";
  ASSERT_EQ(runProgram(other).exitCode, 0);
  EXPECT_EQ(readFile(journal).size(), kept.size());
  folder.write("out/trials.part", kept + "implicit,poi");
  const ProgramResult second = runProgram(words("out")), whole = runProgram(words("whole"));
  ASSERT_EQ(second.exitCode, 0) << second.err;
  EXPECT_EQ(second.out, whole.out);
  EXPECT_FALSE(std::filesystem::exists(journal));
  for (const char* name : {"map.csv", "trials.csv", "stability.gnuplot"})
    EXPECT_EQ(readFile(folder / "out/" + name), readFile(folder / "whole/" + name)) << name;
}

// What is kept is of one scene: another's rows are not taken for its own.
TEST(TrialJournal, KeepsRowsOfTheSameRunAlone) {
  const TemporaryFolder folder;
  StabilityPoint p{"implicit", "point", 0.05, 9e3, true, 1.25, 1};
  {
    TrialJournal journal(folder / "trials.part", 1);
    journal.add(p);
  }
  p.recoveredAt.reset();
  EXPECT_TRUE(TrialJournal(folder / "trials.part", 1).find(p));
  EXPECT_EQ(p.recoveredAt, 1.25);
  // Hours of trials are not thrown away for a slip of the command line.
  const std::string kept = readFile(folder / "trials.part");
  EXPECT_NE(complaintOf([&] { TrialJournal(folder / "trials.part", 2); }).find("holds trials of another run"),
            std::string::npos);
  EXPECT_EQ(readFile(folder / "trials.part"), kept);
  {
    TrialJournal journal(folder / "trials.part", 1);
    journal.forget({p});
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "trials.part"));  // nothing is left to keep
}

// Other trials go on for a while after one that could not be noted: their rows must not follow half of another.
TEST(TrialJournal, AFullDiskSpoilsNoRowThatWasThere) {
  const TemporaryFolder folder;
  StabilityPoint noted{"implicit", "point", 0.05, 9e3, true, 1.25, 1}, half = noted, late = noted;
  half.trial = "flat";
  late.trial = "stretched";
  {
    TrialJournal journal(folder / "trials.part", 1);
    journal.add(noted);
    const auto room = std::filesystem::file_size(folder / "trials.part") + 5;
    EXPECT_EQ(complaintOf([&] {
                const FileSizeLimit limit(room);
                journal.add(half);
              }),
              folder / "trials.part: cannot be written: File too large");
    EXPECT_NE(complaintOf([&] { journal.add(late); }), "");
  }
  TrialJournal journal(folder / "trials.part", 1);
  EXPECT_TRUE(journal.find(noted));
  EXPECT_FALSE(journal.find(half) || journal.find(late));
}

TEST(StabilityCommand, BadStepsAndFreeBodiesAreOneLine) {
  const TemporaryFolder folder;
  const std::string scenes = std::string(MEDULLA_SOURCE_DIR) + "/scenes/";
  const ProgramResult bad = runProgram({"stability", scenes + "gallbladder.xml", "-o", folder / "a", "--steps", "0,1"});
  EXPECT_EQ(bad.exitCode, 2);
  const ProgramResult free = runProgram({"stability", scenes + "heap.xml", "-o", folder / "b"});
  EXPECT_EQ(free.exitCode, 1);
  EXPECT_EQ(free.err, "medulla: body 'bean_0' is not held anywhere: expected a body with <fix>\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "b"));
}

}  // namespace
}  // namespace medulla
