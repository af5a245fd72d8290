#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/commands/commands.h"
#include "app/force_view.h"
#include "app/picture_outputs.h"
#include "render/bounded_buffer.h"
#include "render/stage_times.h"

namespace medulla {

// Draws states in a thread of its own and hands the pictures on: while one picture is drawn, the next is simulated by
// the caller and the last encoded by its video. What is drawn does not depend on when.
class Artist {
 public:
  // Pictures [first, first + count); `rest`: the scene at its start. Returns when drawing can begin; throws what
  // renderer and outputs do.
  Artist(const LoadedScene& loaded, const RenderOptions& options, int first, int count, const DynamicsFrame& rest);
  ~Artist();  // of an unfinished one: drops what waits, and with it the unfinished files
  Artist(const Artist&) = delete;
  Artist& operator=(const Artist&) = delete;

  // Composes the picture of a state and queues it; waits while two are ahead. Throws what went wrong with earlier ones.
  // `forces`: to be shown; may be nullptr.
  void draw(int number, const PictureState& state, ForceView* forces, StageTimes& times);
  void finish();  // waits for the last, and writes the files to their ends
  void commit();  // then: they appear under their names

  // After finish().
  int drawn() const { return drawn_; }  // without those taken over from an earlier run
  const StageTimes& times() const { return times_; }
  const StageTimes::Stage& encoding() const { return encoding_; }  // of all videos, in threads of their own

 private:
  // What one picture needs: as composed, no longer tied to the simulation.
  struct Sheet {
    int number = 0;
    bool needed = true;
    std::vector<Picture> panels;
    std::optional<StripChart> chart;
    std::string caption;
  };
  struct Desk;

  void work(const DynamicsFrame& rest, std::promise<void> ready);
  void drawAll();
  void takePanel();
  void giveBack(Sheet sheet);

  const LoadedScene* loaded_;
  const RenderOptions* options_;
  int first_, count_, panelWidth_;  // panelWidth_: px
  BoundedBuffer<Sheet> sheets_;
  std::unique_ptr<Desk> desk_;             // the thread's; the caller composes with it
  std::optional<PictureOutputs> outputs_;  // the thread's until finish()
  int drawn_ = 0, withoutCaption_ = 0;
  StageTimes::Stage encoding_;
  bool sawBody_ = false;
  StageTimes times_;
  std::thread thread_;
};

}  // namespace medulla
