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
  return {{"gallbladder", "gallbladder", gallbladder, gallbladderBox, 1.0, {466, 15, 0.4}},
          {"gallbladder", "gallbladder_fine", gallbladder, gallbladderBox, 0.8, {20000, 15, 0.4}},
          {"scenery", "liver", liver, {{-175, -65, -105}, {140, 145, 75}}, 2.5, {9000, 40, 0.4}},
          {"scenery", "stomach", stomach, {{-55, -135, -125}, {150, 125, 75}}, 2.5, {5000, 30, 0.5}},
          {"scenery", "fat", fat, {{-220, -240, -125}, {190, -20, 150}}, 2.5, {6000, 15, 0.6}},
          {"scenery", "wall", cavity, {{-270, -220, -195}, {240, 190, 295}}, 9, {4000, 60, 0.6}, true}};
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
