#include "app/commands/artist.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <deque>
#include <exception>
#include <utility>

#include "app/interrupt.h"
#include "app/picture_sources.h"
#include "app/progress.h"
#include "app/standard_streams.h"
#include "physics/content_hash.h"
#include "render/caption.h"
#include "render/viewpoint.h"

namespace medulla {

namespace {

// Two that are drawn, one that waits, one that is composed: more only costs memory.
constexpr std::size_t kSheets = 4;

// What several panels leave over stays black between them.
int panelWidth(const Scene& scene, const ViewOptions& view) {
  const int count = static_cast<int>(view.panels.size()), width = scene.width / count;
  if (width < kPictureSideMin)
    throw std::runtime_error(fmt::format("{} pictures side by side: expected a width of {} at least, not {}", count,
                                         kPictureSideMin * count, scene.width));
  return width;
}

std::string captionAt(const Scene& scene, double time) {
  std::string text = fmt::format("{}   {:.2f} s", scene.name, time);
  for (const SceneCaption& caption : scene.captions)
    if (caption.from <= time && time < caption.to) text += "   " + caption.text;
  return text;
}

// False only where all of the surface lies beyond one side of the picture, or behind the camera: then nobody sees it.
bool isInSight(const std::vector<glm::vec3>& surface, const Viewpoint& viewpoint) {
  std::array<bool, 5> beyond{true, true, true, true, true};
  for (const glm::vec3 p : surface) {
    const glm::vec3 d = p - viewpoint.position;
    const float depth = -glm::dot(viewpoint.back, d), high = depth * viewpoint.tangent, wide = high * viewpoint.aspect;
    const float x = glm::dot(viewpoint.right, d), y = glm::dot(viewpoint.up, d);
    const std::array<bool, 5> outside{depth<0, -x> wide, x > wide, -y > high, y > high};
    for (int k = 0; k < 5; ++k) beyond[k] = beyond[k] && outside[k];
  }
  return std::none_of(beyond.begin(), beyond.end(), [](bool b) { return b; });
}

bool isAnyInSight(const Picture& picture, std::size_t bodies, float aspect) {
  const Viewpoint viewpoint = makeViewpoint(picture.camera, aspect, picture.endoscopeMask);
  return std::any_of(picture.surfaces.begin(), picture.surfaces.begin() + std::ptrdiff_t(bodies),
                     [&](const SurfaceState& surface) { return isInSight(surface.positions, viewpoint); });
}

PictureOutputs::Settings outputSettings(const LoadedScene& loaded, const RenderOptions& options, int first, int count,
                                        const std::string& renderer) {
  const Scene& scene = loaded.scene;
  std::string drawing =
      fmt::format("{} {}x{} {} {} {} {}", MEDULLA_PICTURE_SOURCES, scene.width, scene.height, scene.fps,
                  namesOf(options.view.shown), static_cast<int>(options.quality), renderer);
  for (const ViewKind panel : options.view.panels) drawing += fmt::format(" {}", static_cast<int>(panel));
  const std::uint64_t run = contentHash(drawing, pictureHash(loaded));
  return {scene.width,
          scene.height,
          scene.fps,
          options.still.has_value(),
          {first, first + count, !options.frames, run, options.resume}};
}

}  // namespace

// All that touches OpenGL: made and ended in the thread that draws.
struct Artist::Desk {
  Renderer renderer;
  SceneView view;
  Image panel, image;
  Progress progress;
  int done = 0;
  std::deque<Sheet> begun;  // pictures at work, the oldest first
  int ahead = 0;            // panels begun and not taken
  int taken = 0;            // panels of the oldest picture

  Desk(const LoadedScene& loaded, const RenderOptions& options, int count, int width, const DynamicsFrame& rest)
      : renderer(rendererSettings(width, loaded.scene.height, options.context, options.quality)),
        view(loaded, rest, renderer),
        image(blackImage(loaded.scene.width, loaded.scene.height)),
        progress("render", static_cast<double>(count), "pictures") {}
};

Artist::Artist(const LoadedScene& loaded, const RenderOptions& options, int first, int count, const DynamicsFrame& rest)
    : loaded_(&loaded),
      options_(&options),
      first_(first),
      count_(count),
      panelWidth_(panelWidth(loaded.scene, options.view)),
      sheets_(kSheets) {
  std::promise<void> ready;
  std::future<void> begun = ready.get_future();
  thread_ = std::thread([this, &rest, ready = std::move(ready)]() mutable { work(rest, std::move(ready)); });
  try {
    begun.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

Artist::~Artist() {
  sheets_.abandon();
  if (thread_.joinable()) thread_.join();
}

void Artist::work(const DynamicsFrame& rest, std::promise<void> ready) {
  try {
    times_.start("start drawing");
    desk_ = std::make_unique<Desk>(*loaded_, *options_, count_, panelWidth_, rest);
    outputs_.emplace(options_->outputs,
                     outputSettings(*loaded_, *options_, first_, count_, desk_->renderer.description()));
  } catch (...) {
    desk_.reset();  // here, where its context is current
    ready.set_exception(std::current_exception());
    return;
  }
  ready.set_value();
  try {
    drawAll();
  } catch (...) {
    sheets_.fail(std::current_exception());
  }
  while (sheets_.next()) {
    // What comes now is not drawn: the caller may be composing with what is on the desk, until it says that it ends.
  }
  desk_.reset();
}

void Artist::drawAll() {
  for (;;) {
    times_.start("idle");
    std::optional<Sheet> sheet = sheets_.next();
    if (!sheet) break;
    checkInterrupt();
    if (!sheet->needed) {
      giveBack(std::move(*sheet));
      continue;
    }
    desk_->begun.push_back(std::move(*sheet));
    // The first panel of this picture meets the last one of the picture before.
    for (const Picture& panel : desk_->begun.back().panels) {
      desk_->renderer.begin(panel, &times_);
      if (++desk_->ahead == 2) takePanel();
    }
  }
  if (sheets_.abandoned()) return;
  while (desk_->ahead > 0) takePanel();
  checkInterrupt();
  times_.start("end files");
  outputs_->finish();
  times_.stop();
  encoding_ = outputs_->encoding();
}

void Artist::takePanel() {
  Desk& desk = *desk_;
  const int count = static_cast<int>(options_->view.panels.size()), room = loaded_->scene.width - panelWidth_;
  desk.renderer.take(count == 1 ? desk.image : desk.panel, &times_);
  --desk.ahead;
  if (count > 1) copyInto(desk.panel, desk.taken * room / (count - 1), desk.image);
  if (++desk.taken < count) return;
  desk.taken = 0;
  Sheet sheet = std::move(desk.begun.front());
  desk.begun.pop_front();
  times_.start("letters");
  if (sheet.chart) drawStripChart(*sheet.chart, desk.image);
  if (!sheet.caption.empty() && !drawCaption(sheet.caption, panelWidth_, desk.image)) ++withoutCaption_;
  times_.start("hand over");
  outputs_->write(sheet.number, desk.image);
  ++drawn_;
  giveBack(std::move(sheet));
}

// Back to the caller.
void Artist::giveBack(Sheet sheet) {
  desk_->progress.update(++desk_->done);
  sheets_.giveBack(std::move(sheet));
}

void Artist::draw(int number, const PictureState& state, ForceView* forces, StageTimes& times) {
  times.start("wait");
  Sheet sheet = sheets_.take();
  times.start("compose");
  sheet.number = number;
  sheet.needed = !outputs_->has(number);
  if (forces != nullptr) sheet.chart = forces->chart(state);
  if (options_->view.shown.caption) sheet.caption = captionAt(loaded_->scene, state.time);
  sheet.panels.resize(options_->view.panels.size());
  for (std::size_t k = 0; sheet.needed && k < sheet.panels.size(); ++k) {
    desk_->view.compose(state, options_->view.panels[k], options_->view.shown, sheet.panels[k]);
    if (forces != nullptr) forces->addArrows(state, sheet.panels[k]);
  }
  if (sheet.needed && !sawBody_)
    sawBody_ =
        isAnyInSight(sheet.panels[0], loaded_->scene.bodies.size(), float(panelWidth_) / float(loaded_->scene.height));
  sheets_.give(std::move(sheet));
  times.stop();
}

void Artist::finish() {
  sheets_.end();
  thread_.join();
  sheets_.rethrow();
  if (drawn_ > 0 && !sawBody_) tell("note: no body is in sight of the camera in any picture\n");
  if (withoutCaption_ > 0) tell("note: {} of {} pictures are too small for their caption\n", withoutCaption_, drawn_);
}

void Artist::commit() {
  for (const std::string& note : outputs_->commit()) tell("note: {}\n", note);
}

}  // namespace medulla
