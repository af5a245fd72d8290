// medulla_shapes -o DIR [NAME...]: makes the committed meshes from the organs' signed distance functions.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "assets/shapes/mesh_check.h"
#include "assets/shapes/obj_writer.h"
#include "assets/shapes/organs.h"
#include "assets/shapes/remesh.h"
#include "assets/shapes/surface_nets.h"
#include "assets/shapes/toys.h"

namespace medulla {

struct MeshRecipe {
  std::string folder, name;
  SignedDistance sdf;
  Box box;             // mm, encloses the organ
  double gridSpacing;  // mm
  RemeshSettings remesh;
  bool seenFromInside = false;  // wound clockwise seen from outside
};

static std::vector<MeshRecipe> recipes() {
  const Box gallbladderBox{{-85, -80, -35}, {-5, 10, 45}};
  const Box liverBox{{-160, -85, -100}, {100, 125, 60}}, stomachBox{{-60, -140, -110}, {155, 130, 75}};
  const Box colonBox{{-165, -315, -110}, {185, 30, 90}}, intestineBox{{-130, -300, -60}, {150, -110, 100}};
  const Box dolphinBox{{-1290, -480, -520}, {1290, 480, 520}};
  const auto thinFins = [](const Eigen::Vector3d& p) { return dolphin(p, 6, {18, 3}); };
  const auto thickFins = [](const Eigen::Vector3d& p) { return dolphin(p, 20, {8, 6}); };
  return {{"gallbladder", "gallbladder", gallbladder, gallbladderBox, 1.0, {466, 15, 0.4}},
          {"gallbladder", "gallbladder_fine", gallbladder, gallbladderBox, 0.8, {20000, 15, 0.4}},
          {"liver", "liver", liver, liverBox, 2.5, {2000, 40, 0.4}},
          {"liver", "liver_fine", liver, liverBox, 1.6, {24000, 40, 0.4}},
          {"stomach", "stomach", stomach, stomachBox, 2.5, {1500, 30, 0.4}},
          {"stomach", "stomach_fine", stomach, stomachBox, 1.6, {16000, 30, 0.5}},
          {"gut", "colon", colon, colonBox, 2.2, {3200, 32, 0.33}},
          {"gut", "colon_fine", colon, colonBox, 2.2, {24000, 15, 0.4}},
          {"gut", "small_intestine", smallIntestine, intestineBox, 1.6, {2800, 12, 0.5}},
          {"gut", "small_intestine_fine", smallIntestine, intestineBox, 1.5, {20000, 12, 0.5}},
          {"dolphin", "dolphin", thickFins, dolphinBox, 12, {1120, 250, 0.3, true}},
          {"dolphin", "dolphin_fine", thinFins, dolphinBox, 8, {16000, 150, 0.3, true}},
          {"toys", "bean", bean, {{-70, -40, -35}, {70, 45, 35}}, 2, {200, 30, 0.5}},
          {"toys", "drop", drop, {{-40, -55, -40}, {40, 60, 40}}, 2, {160, 30, 0.5}},
          {"toys", "star", star, {{-65, -60, -30}, {65, 65, 30}}, 2, {240, 30, 0.5}},
          {"toys", "bowl", bowl, {{-230, -250, -230}, {230, 40, 230}}, 4, {4000, 200, 0.5}},
          {"toys", "bowl_fine", bowl, {{-230, -250, -230}, {230, 40, 230}}, 3, {26000, 120, 0.3}},
          {"scenery", "fat", fat, {{-220, -240, -125}, {190, -20, 150}}, 2.2, {18000, 15, 0.6}},
          {"scenery", "wall", cavity, {{-270, -450, -220}, {265, 205, 300}}, 9, {4000, 60, 0.6}, true}};
}

static void makeMesh(const MeshRecipe& recipe, const std::filesystem::path& directory) {
  TriangleMesh mesh = remesh(surfaceNets(recipe.sdf, recipe.box, recipe.gridSpacing), recipe.sdf, recipe.remesh);
  if (recipe.seenFromInside)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  const MeshCheck check = checkMesh(mesh);
  fmt::print("{}: {} triangles, length {:.1f} mm, volume {:.1f} ml, genus {}, quality min {:.2f} median {:.2f}\n",
             recipe.name, mesh.triangles.size(), meshLength(mesh), check.volume / 1000, check.genus, check.qualityMin,
             check.qualityMedian);
  if (!check.manifold || check.components != 1 || check.genus != 0)
    throw std::runtime_error(recipe.name + ": expected a closed manifold surface of genus 0");
  const std::filesystem::path folder = directory / recipe.folder;
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / (recipe.name + ".obj"), std::ios::binary);
  file << objText(mesh, recipe.name);
  if (!file.flush()) throw std::runtime_error("cannot write " + (folder / (recipe.name + ".obj")).string());
}

static int run(const std::vector<std::string>& arguments) {
  const std::vector<MeshRecipe> all = recipes();
  std::vector<std::string> names(arguments.begin() + std::min<std::ptrdiff_t>(2, std::ssize(arguments)),
                                 arguments.end());
  const auto isKnown = [&](const std::string& name) {
    return std::any_of(all.begin(), all.end(), [&](const MeshRecipe& r) { return r.name == name; });
  };
  if (arguments.size() < 2 || arguments[0] != "-o" || !std::all_of(names.begin(), names.end(), isKnown)) {
    fmt::print(stderr, "usage: medulla_shapes -o DIR [NAME...]\nnames:");
    for (const MeshRecipe& recipe : all) fmt::print(stderr, " {}", recipe.name);
    fmt::print(stderr, "\n");
    return 2;
  }
  for (const MeshRecipe& recipe : all)
    if (names.empty() || std::count(names.begin(), names.end(), recipe.name)) makeMesh(recipe, arguments[1]);
  return 0;
}

}  // namespace medulla

int main(int argc, char** argv) {
  try {
    return medulla::run(std::vector<std::string>(argv + 1, argv + argc));
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
