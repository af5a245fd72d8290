#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "app/files/recording_map.h"
#include "app/files/scene_rules.h"
#include "app/files/text.h"
#include "app/files/xml_element.h"
#include "render/renderer.h"

namespace medulla {
namespace {

// What the schema knows of an element, as sorted lists: attributes (required ones with a !) and children.
struct Known {
  std::set<std::string> attributes, children;
};

void expectSameNames(const char* path, const XmlRules& rules) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.LoadFile(path), tinyxml2::XML_SUCCESS);
  std::map<std::string, Known> schema;
  const tinyxml2::XMLElement* e = document.RootElement()->FirstChildElement("xs:element");
  for (; e; e = e->NextSiblingElement("xs:element")) {
    Known& known = schema[e->Attribute("name")];
    const tinyxml2::XMLElement* type = e->FirstChildElement("xs:complexType");
    ASSERT_NE(type, nullptr);
    const tinyxml2::XMLElement* a = type->FirstChildElement("xs:attribute");
    for (; a; a = a->NextSiblingElement("xs:attribute")) {
      known.attributes.insert(std::string(a->Attribute("name")) + (a->Attribute("use", "required") ? "!" : ""));
    }
    const tinyxml2::XMLElement* choice = type->FirstChildElement("xs:choice");
    const tinyxml2::XMLElement* c = choice ? choice->FirstChildElement("xs:element") : nullptr;
    for (; c; c = c->NextSiblingElement("xs:element")) known.children.insert(c->Attribute("ref"));
  }
  EXPECT_EQ(schema.size(), rules.size());
  for (const XmlRule& rule : rules) {
    Known expected;
    for (const std::string& a : rule.required) expected.attributes.insert(a + "!");
    for (const std::string& a : rule.optional) expected.attributes.insert(a);
    for (const XmlRule::Child& child : rule.children) expected.children.insert(child.name);
    EXPECT_EQ(schema[rule.element].attributes, expected.attributes) << rule.element;
    EXPECT_EQ(schema[rule.element].children, expected.children) << rule.element;
  }
}

TEST(SceneSchema, KnowsWhatTheReaderKnows) {
  expectSameNames(MEDULLA_SOURCE_DIR "/scenes/scene.xsd", sceneRules());
  expectSameNames(MEDULLA_SOURCE_DIR "/scenes/recording.xsd", recordingRules());
}

TEST(SceneSchema, KnowsEveryLook) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.LoadFile(MEDULLA_SOURCE_DIR "/scenes/scene.xsd"), tinyxml2::XML_SUCCESS);
  std::vector<std::string> looks;
  for (const auto* type = document.RootElement()->FirstChildElement("xs:simpleType"); type;
       type = type->NextSiblingElement("xs:simpleType")) {
    if (!type->Attribute("name", "look")) continue;
    const auto* restriction = type->FirstChildElement("xs:restriction");
    ASSERT_NE(restriction, nullptr);
    for (const auto* e = restriction->FirstChildElement("xs:enumeration"); e;
         e = e->NextSiblingElement("xs:enumeration"))
      looks.emplace_back(e->Attribute("value"));
  }
  EXPECT_EQ(looks, lookNames());
}

TEST(NearestName, CountsInsertionsDeletionsReplacementsAndSwaps) {
  EXPECT_EQ(nearestName("positon", {"orientation", "position", "links"}), "position");
  EXPECT_EQ(nearestName("fvo", {"fix", "fov"}), "fov");
  EXPECT_EQ(nearestName("x", {"ab", "cd"}), "ab");  // the first of equals
  EXPECT_EQ(nearestName("x", {}), "");
  EXPECT_EQ(nearestName(std::string(1 << 20, 'a'), {"b", "a"}), "a");  // quick about it, too
}

}  // namespace
}  // namespace medulla
