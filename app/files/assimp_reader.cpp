#include "app/files/assimp_reader.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string_view>

#include "app/files/input_error.h"
#include "app/files/text.h"

// In place of assimp's own, which ends the program: Debian builds it with assertions, and a damaged file breaks them.
namespace Assimp {
void aiAssertViolation(const char* expression, const char* file, int line);
void aiAssertViolation(const char* expression, const char*, int) {
  throw std::runtime_error(std::string("assimp expected ") + expression);
}
}  // namespace Assimp

namespace medulla {

namespace {

// One line, whatever assimp had to say: it may quote all that is left of a file.
std::string oneLine(std::string text) {
  constexpr std::size_t kLongest = 200;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text.empty() ? "no reason given" : text;
}

const aiScene* import(Assimp::Importer& importer, const std::string& path) {
  // Everything but positions is dropped before joining: facets' own normals would keep their corners apart.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, ~static_cast<int>(aiComponent_MESHES));
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  constexpr unsigned kSteps = aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_SortByPType |
                              aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices |
                              aiProcess_ValidateDataStructure;  // first: the other steps trust indices
  const aiScene* scene = nullptr;
  std::string reason;
  try {
    scene = importer.ReadFile(path, kSteps);
    reason = importer.GetErrorString();
  } catch (const std::exception& e) {
    reason = e.what();
  }
  if (scene == nullptr) throw inputError(path, 0, "not a readable mesh: " + oneLine(reason));
  if (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) throw inputError(path, 0, "holds no mesh");
  return scene;
}

}  // namespace

// Of the seventy that assimp takes, those that meshes are exchanged in. Among the others are scenes and motions that
// name meshes and are none: assimp 5.2 crashes on an empty .lws, does not end on a damaged .md5mesh, and takes any
// bytes under .ase for a skeleton, for which it puts an octahedron.
constexpr std::string_view kFormats[] = {".3ds", ".3mf", ".ac",   ".amf", ".dae", ".dxf",
                                         ".fbx", ".glb", ".gltf", ".lwo", ".x",   ".x3d"};

bool assimpReads(const std::string& extension) {
  return isOneOf(extension, kFormats) && Assimp::Importer().IsExtensionSupported(extension);
}

std::string assimpFormats() {
  return joined(kFormats, ", ");
}

TriangleMesh readWithAssimp(const std::string& path) {
  Assimp::Importer importer;
  const aiScene* scene = import(importer, path);
  TriangleMesh mesh;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    const int offset = static_cast<int>(mesh.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
        throw inputError(path, 0, "vertex " + std::to_string(mesh.vertices.size()) + " is not finite");
      mesh.vertices.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      std::array<int, 3> triangle;
      for (int k = 0; k < 3; ++k) {
        if (face.mIndices[k] >= part.mNumVertices) throw inputError(path, 0, "a face refers to a vertex out of range");
        triangle[k] = offset + static_cast<int>(face.mIndices[k]);
      }
      mesh.triangles.push_back(triangle);
    }
  }
  if (mesh.triangles.empty()) throw inputError(path, 0, "no triangles in this file");
  return mesh;
}

}  // namespace medulla
