#include "app/files/mesh_file.h"

#include <filesystem>
#include <string_view>
#include <system_error>

#include "app/files/assimp_reader.h"
#include "app/files/input_error.h"
#include "app/files/obj_reader.h"
#include "app/files/off_reader.h"
#include "app/files/ply_reader.h"
#include "app/files/stl_reader.h"
#include "app/files/text.h"
#include "app/files/text_file.h"

namespace medulla {

namespace {

std::string extensionOf(const std::string& path) {
  return lowered(std::filesystem::path(path).extension().string());
}

// Complaints that all formats share, before any reader sees the path.
void requireMeshFile(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw inputError(path, 0, "cannot be opened: " + error.message());
  if (std::filesystem::is_directory(status)) throw inputError(path, 0, "is a folder, expected a mesh file");
  if (!std::filesystem::is_regular_file(status)) throw inputError(path, 0, "is not a file, expected a mesh file");
  if (std::filesystem::file_size(path, error) == 0) throw inputError(path, 0, "is empty, expected a mesh file");
}

}  // namespace

const std::vector<std::string>& lengthUnits() {
  static const std::vector<std::string> units = {"m", "cm", "mm", "micron", "inch"};
  return units;
}

double metresPerUnit(const std::string& unit) {
  constexpr double metres[] = {1, 0.01, 0.001, 1e-6, 0.0254};
  for (std::size_t k = 0; k < lengthUnits().size(); ++k)
    if (unit == lengthUnits()[k]) return metres[k];
  throw std::runtime_error("unknown unit '" + unit + "', expected m, cm, mm, micron or inch");
}

bool isMeshFile(const std::string& path) {
  const std::string extension = extensionOf(path);
  return extension == ".obj" || extension == ".off" || extension == ".ply" || extension == ".stl" ||
         assimpReads(extension);
}

TriangleMesh readMesh(const std::string& path, double metresPerFileUnit) {
  requireMeshFile(path);
  const std::string extension = extensionOf(path);
  TriangleMesh mesh;
  if (extension == ".obj") {
    mesh = parseObj(readTextFile(path), path);
  } else if (extension == ".off") {
    mesh = parseOff(readTextFile(path), path);
  } else if (extension == ".ply") {
    mesh = parsePly(readTextFile(path), path);
  } else if (extension == ".stl") {
    std::string bytes = readBytes(path);
    constexpr std::string_view kMark = "\xef\xbb\xbf";  // before text; binary files have names of their own there
    if (bytes.starts_with(std::string(kMark) + "solid")) bytes.erase(0, kMark.size());
    mesh = parseStl(bytes, path);
  } else if (assimpReads(extension)) {
    mesh = readWithAssimp(path);
  } else {
    throw inputError(path, 0,
                     "unknown mesh format '" + extension +
                         "', expected .obj, .off, .stl, .ply, or one that assimp reads: " + assimpFormats());
  }
  for (auto& vertex : mesh.vertices) vertex *= metresPerFileUnit;
  return mesh;
}

}  // namespace medulla
