#include <fmt/format.h>

#include <memory>
#include <optional>

#include "app/commands/commands.h"
#include "app/enum_names.h"
#include "app/files/mesh_file.h"
#include "app/files/number_text.h"
#include "app/verbs.h"

// The verbs that make models.
namespace medulla {

namespace {

struct BuildArguments {
  BuildOptions options;
  std::string method = nameOf(options.settings.method), linkForm = nameOf(options.identification.links);
  std::vector<const CLI::Option*> ofCover;  // which the skeleton follows none of
};

BuildOptions buildOptions(const BuildArguments& a) {
  BuildOptions options = a.options;
  options.settings.method = valueNamed<BuildMethod>(a.method);
  const BuildSettings& s = options.settings;
  for (const CLI::Option* option : a.ofCover)
    if (option->count() > 0 && s.method != BuildMethod::cover)
      usageError(option->get_name(), option->as<std::string>(),
                 "--method cover with it: of a skeleton it says nothing");
  if (options.meshes.size() == 1) refuseOtherKinds("-o", options.output, ".xml");
  refuseOtherKinds("--report", options.reportPath, ".csv");
  if (!options.fine.empty() && options.fine.size() != options.meshes.size())
    usageError("--fine", options.fine.back(),
               fmt::format("one for each of {} meshes, not {}", options.meshes.size(), options.fine.size()));
  options.identification.links = valueNamed<LinkForm>(a.linkForm);
  if (options.identify && options.meshes.size() > 1)
    usageError("--identify", "", fmt::format("a single mesh, not {}", options.meshes.size()));
  if (options.identify && s.method == BuildMethod::cover && s.gap == 0 && s.spheres > kIdentifiedSpheresMax)
    usageError("--spheres", fmt::format("{}", s.spheres),
               fmt::format("at most {} with --identify: its time grows with their cube", kIdentifiedSpheresMax));
  return options;
}

void addCoverOptions(CLI::App& c, BuildArguments& a) {
  CLI::Option* spheres = c.add_option("--spheres", a.options.settings.spheres,
                                      "number of filling spheres, of --method cover; of several meshes together: "
                                      "shared out so that the largest gap, in metres, "
                                      "is about the same for all")
                             ->transform(wholeNumberFrom(1, kSpheresMax))
                             ->capture_default_str();
  CLI::Option* gap =
      c.add_option(
           "--gap", a.options.settings.gap,
           "instead of a number: the fewest spheres, of each mesh, that leave no wider gap between the surface and "
           "the nearest sphere, in % of the bounding box's diagonal")
          ->check(numberFrom(0.01, 99))
          ->type_name("PERCENT")
          ->excludes(spheres);
  CLI::Option* overshoot =
      c.add_option(
           "--overshoot", a.options.settings.overshoot,
           "how far spheres may stick out of the surface, in % of the bounding box's diagonal: they fill more, and "
           "bodies touch by so much too early instead of sinking in by the gap [4.2 / sqrt(spheres), or half the gap, "
           "5 at most]")
          ->check(numberFrom(0, 5))
          ->type_name("PERCENT");
  a.ofCover = {spheres, gap, overshoot};
}

CLI::Validator compressible() {
  const auto check = [](const std::string& word) {
    const std::optional<double> value = parseNumber<double>(word);
    return value && *value >= 0 && *value < 0.5 ? "" : word + ": expected a number from 0 to less than 0.5";
  };
  return CLI::Validator(check, "in [0 - 0.5)");
}

void addIdentification(CLI::App& c, BuildArguments& a) {
  CLI::Option* identify = c.add_flag(
      "--identify", a.options.identify,
      fmt::format("find the links' stiffness by finite elements of the one mesh, held as --fix says, for bodies that "
                  "are no network of beams; seconds for a few spheres, much longer for many, {} at most",
                  kIdentifiedSpheresMax));
  c.add_option("--fix", a.options.fix,
               "what scenes hold, as their <fix>: box=x0,y0,z0,x1,y1,z1, sphere=x,y,z,r, plane=nx,ny,nz,d (m) or "
               "vertices=FILE.csv; may be given more than once. A box, sphere or plane holds the material behind its "
               "triangles, too, vertices the surface alone")
      ->type_name("REGION")
      ->allow_extra_args(false)
      ->needs(identify);
  c.add_option("--poisson", a.options.identification.poisson,
               "Poisson's ratio of the tissue that a scene gives it, 0 to less than 0.5")
      ->check(compressible())
      ->needs(identify)
      ->capture_default_str();
  c.add_option(
       "--link-form", a.linkForm,
       "diagonal: six scalars per link; uncoupled: any stiffness between its two frames; full: couples the links "
       "of a cell, too, which is nearer, with shorter substeps")
      ->check(CLI::IsMember(namesOf(LinkForm{})))
      ->needs(identify)
      ->capture_default_str();
}

}  // namespace

Verb addBuild(CLI::App& app) {
  const auto arguments = std::make_shared<BuildArguments>();
  BuildArguments& a = *arguments;
  CLI::App* c = app.add_subcommand("build", "make a model of filling spheres from each closed triangle mesh");
  c->add_option("MESH", a.options.meshes, "closed surface: OBJ, OFF, STL, PLY, ...; one body each")->required();
  c->add_option("-o,--output", a.options.output,
                "model file to write; for several meshes a folder, where each becomes MESH.model.xml")
      ->type_name("MODEL.xml|DIR")
      ->required();
  addCoverOptions(*c, a);
  c->add_option("--method", a.method, "cover: balls chosen to fill the body; skeleton: the raw edge collapse")
      ->check(CLI::IsMember(namesOf(BuildMethod{})))
      ->capture_default_str();
  c->add_option("--unit", a.options.unit, "unit of the mesh files")
      ->check(CLI::IsMember(lengthUnits()))
      ->capture_default_str();
  c->add_option("--fine", a.options.fine, "detailed shape that the drawn surface follows; of several meshes one each")
      ->type_name("MESH")
      ->allow_extra_args(false);
  c->add_option("--surface-mass", a.options.settings.surfaceMassFraction,
                "share of the mass that surface nodes carry; more allows larger substeps")
      ->check(numberFrom(0, 0.4))
      ->capture_default_str();
  c->add_option("--render-levels", a.options.renderLevels,
                "subdivisions of the mesh for the drawn surface [2, of fine meshes fewer: 200000 triangles at most, or "
                "the mesh's own]")
      ->transform(wholeNumberFrom(0, 4));
  c->add_option("--report", a.options.reportPath, "write the quality report as CSV too")->type_name("FILE.csv");
  addIdentification(*c, a);
  return {c, [arguments] { return runBuild(buildOptions(*arguments)); }};
}

Verb addNew(CLI::App& app) {
  const auto options = std::make_shared<NewOptions>();
  NewOptions& o = *options;
  CLI::App* c = app.add_subcommand("new", "make a scene, a model and a trajectory around a mesh, ready to render");
  c->add_option("MESH", o.build.meshes, "closed surface: OBJ, OFF, STL, PLY, ...")->required()->expected(1);
  c->add_option("-o,--output", o.folder, "folder for NAME.xml, NAME.model.xml and NAME.csv; made where missing")
      ->type_name("DIR")
      ->required();
  c->add_option("--spheres", o.build.settings.spheres, "number of filling spheres")
      ->transform(wholeNumberFrom(1, kSpheresMax))
      ->capture_default_str();
  c->add_option("--unit", o.build.unit, "unit of the mesh file")
      ->check(CLI::IsMember(lengthUnits()))
      ->capture_default_str();
  return {c, [options] { return runNew(*options); }};
}

}  // namespace medulla
