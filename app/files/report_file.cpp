#include "app/files/report_file.h"

#include <algorithm>

#include "app/files/output_file.h"

namespace medulla {

std::vector<Result> buildResults(const BuildReport& r) {
  return {{"triangles", numberText(r.triangles), ""},
          {"skeleton_nodes", numberText(r.skeletonNodes), ""},
          {"skeleton_links", numberText(r.skeletonLinks), ""},
          {"volume", numberText(r.volume), "m3"},
          {"diagonal", numberText(r.diagonal), "m"},
          {"spheres", numberText(r.spheres), ""},
          {"links", numberText(r.links), ""},
          {"gap_max", numberText(r.gapMax), "%"},
          {"gap_mean", numberText(r.gapMean), "%"},
          {"gap_cones_max", numberText(r.gapConesMax), "%"},
          {"overshoot_max", numberText(r.overshootMax), "%"},
          {"cover", numberText(r.cover), "%"},
          {"cover_cones", numberText(r.coverCones), "%"},
          {"mass_error", numberText(r.massError), "%"},
          {"centre_error", numberText(r.centreError), "%"},
          {"inertia_error", numberText(r.inertiaError), "%"},
          {"components", numberText(r.components), ""},
          {"centres_outside", numberText(r.centresOutside), ""},
          {"attachments_crossing", numberText(r.attachmentsCrossing), ""},
          {"attachment_max", numberText(r.attachmentMax), "%"},
          {"degree_max", numberText(r.degreeMax), ""},
          {"drawn_inside_max", numberText(r.drawnInsideMax), "%"},
          {"seconds", numberText(r.seconds), "s"}};
}

std::vector<Result> identifiedResults(const IdentifiedNetwork& n, const std::optional<IdentifiedError>& formulas) {
  std::vector<Result> results = {{"identified_voxel", numberText(n.voxel), "m"},
                                 {"identified_links", numberText(n.links.size()), ""},
                                 {"identified_patches", numberText(n.patches.size()), ""}};
  const auto add = [&](const std::string& name, const IdentifiedError& error) {
    results.push_back({name + "_max", numberText(error.maximum), "%"});
    results.push_back({name + "_rms", numberText(error.rms), "%"});
  };
  add("identified_error", n.bulk);
  add("identified_poke_error", n.poke);
  add("finite_elements_error", n.ofFiniteElements);
  if (formulas) add("formulas_error", *formulas);
  results.push_back({"identified_used", n.usesFormulas ? "0" : "1", ""});
  return results;
}

std::vector<Result> totalResults(const std::vector<BuildReport>& reports) {
  BuildReport total;
  double covered = 0, widest = 0;
  for (const BuildReport& r : reports) {
    total.triangles += r.triangles;
    total.spheres += r.spheres;
    total.links += r.links;
    total.volume += r.volume;
    total.seconds += r.seconds;
    covered += r.cover * r.volume;
    widest = std::max(widest, r.gapMax / 100 * r.diagonal);
  }
  return {{"triangles", numberText(total.triangles), ""}, {"volume", numberText(total.volume), "m3"},
          {"spheres", numberText(total.spheres), ""},     {"links", numberText(total.links), ""},
          {"gap_max", numberText(widest), "m"},           {"cover", numberText(covered / total.volume), "%"},
          {"seconds", numberText(total.seconds), "s"}};
}

void writeReport(const std::string& path, const std::vector<Result>& results) {
  OutputFile file(path);
  file.write("name,value,unit\n");
  for (const Result& r : results) file.write(r.name + "," + r.value + "," + r.unit + "\n");
  file.commit();
}

}  // namespace medulla
