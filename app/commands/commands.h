#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/commands/run.h"
#include "app/scene_view.h"
#include "physics/model/build.h"
#include "physics/model/identify/identify.h"

// One function per verb of the command line; each returns the exit code and throws std::runtime_error for bad input.
namespace medulla {

struct BuildOptions {
  std::vector<std::string> meshes;             // at least one
  std::vector<std::string> fine;               // none, or one per mesh
  std::string unit = "m", output, reportPath;  // output: the model, of several meshes a folder for NAME.model.xml each
  BuildSettings settings;                      // spheres: of all meshes together; renderLevels: as below
  std::optional<int> renderLevels;             // without a value: renderLevelsFor each mesh
  bool identify = false;                       // of one mesh only
  std::vector<std::string> fix;                // as parseHeldRegion() reads them
  IdentifySettings identification;
};
int runBuild(const BuildOptions& options);

struct NewOptions {
  BuildOptions build;  // its output is chosen here
  std::string folder;
};
int runNew(const NewOptions& options);

int runCheck(const RunOptions& options);

struct InfoOptions {
  std::string path, unit = "m";  // unit: of a mesh
};
// What a mesh (told by its ending), a model, a scene, a recording (by their root element), a trajectory, a log or a
// state cache holds.
int runInfo(const InfoOptions& options);

int runReplay(const RunOptions& options);

struct RenderOptions {
  RunOptions run;
  // FILE.mp4, .webm, .gif, .webp, a folder for numbered PNG files; of a still FILE.png
  std::vector<std::string> outputs;
  std::string cacheToRead;  // states of an earlier run of the same motion; empty: simulate
  ViewOptions view;
  Quality quality = Quality::standard;
  std::optional<double> still;                // s, >= 0: one picture at this time
  std::optional<std::pair<int, int>> size;    // pixels
  std::optional<double> fps;                  // Hz
  std::optional<std::pair<int, int>> frames;  // [first, last)
  std::string context = "auto";
  bool resume = false;   // folders of PNG files only: what an ended run left is not drawn again
  bool timings = false;  // a table on standard error, per stage
};
int runRender(const RenderOptions& options);

struct GoldenOptions {
  std::vector<std::string> scenes;      // empty: those that the folder's images name; without folder scenes/*.xml
  std::string folder;                   // of the golden images; empty: golden_images beside the scene's folder
  std::vector<std::string> update;      // scenes (file or name) and moments to store anew; empty: compare
  std::string failures = "out/golden";  // folder for report.html and pictures that fail
  std::string context = "auto";
};
int runGolden(const GoldenOptions& options);

struct CompareOptions {
  std::string a, b;      // two logs or two state caches
  double tolerance = 0;  // share of the largest value that a column has in either; 0: the same
};
int runCompare(const CompareOptions& options);

struct PlotOptions {
  std::string log, output;  // output: FILE.png or FILE.svg
  std::string frameTimes;   // empty: no panel of them
};
int runPlot(const PlotOptions& options);

struct ChartOptions {
  RunOptions run;  // scene, overrides and trajectories
  // For chart.csv, chart.gnuplot and chart.svg, and of several models spheres.*; made where missing.
  std::string folder;
  // s; substeps are whole shares of a dynamics frame, the nearest to these. 0: what a run's stability estimate allows.
  std::vector<double> steps;
  std::vector<std::string> methods;  // of chartMethodNames(), at least one; the first is the reference's
  std::vector<NamedFile> models;     // of the scene's mesh with other numbers of spheres; empty: its own
};
std::vector<std::string> chartMethodNames();
std::vector<std::string> chartMethodsOfAnyModel();  // of these, those that need nothing of a model
int runChart(const ChartOptions& options);

struct StabilityOptions {
  RunOptions run;                         // of its scene, the first body
  std::string folder;                     // for map.csv, trials.csv, stability.gnuplot and stability.svg
  std::vector<std::string> methods;       // of tortureMethods(), at least one
  std::vector<double> steps, trialSteps;  // s, of the map and of the trials
  std::vector<double> young;              // Pa, of the map
  int threads = 1;                        // trials side by side; these change no outcome
};
int runStability(const StabilityOptions& options);

int printVersion();

}  // namespace medulla
