#include "scenes/anatomy.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace limber::scenes {
namespace {

// Names as segmentations of scans have them.
TEST(Anatomy, KnowsWhatSegmentationsCallBonesAndOrgans) {
  for (const char* bone : {"sacrum",         "vertebrae_S1",
                           "vertebrae_L5",   "vertebrae_C1",
                           "humerus_left",   "scapula_right",
                           "clavicula_left", "femur_left",
                           "hip_right",      "skull",
                           "rib_left_1",     "rib_right_12",
                           "sternum",        "costal_cartilages",
                           "spine",          "spine_column",
                           "pelvis",         "Third lumbar vertebra",
                           "Bones",          "tibia"})
    EXPECT_EQ(anatomy_of(bone).kind, PartKind::bone) << bone;
  for (const char* hull : {"skin", "body", "ribcage", "SKIN"})
    EXPECT_EQ(anatomy_of(hull).kind, PartKind::hull) << hull;
  const Anatomy& unknown = anatomy_of("what is this");
  EXPECT_EQ(unknown.words, "");
  for (const char* soft : {"spleen",
                           "kidney_right",
                           "kidney_cyst_left",
                           "gallbladder",
                           "liver",
                           "stomach",
                           "pancreas",
                           "adrenal_gland_right",
                           "lung_upper_lobe_left",
                           "esophagus",
                           "trachea",
                           "thyroid_gland",
                           "small_bowel",
                           "duodenum",
                           "colon",
                           "urinary_bladder",
                           "prostate",
                           "heart",
                           "aorta",
                           "pulmonary_vein",
                           "brachiocephalic_trunk",
                           "subclavian_artery_right",
                           "common_carotid_artery_left",
                           "brachiocephalic_vein_left",
                           "atrial_appendage_left",
                           "superior_vena_cava",
                           "inferior_vena_cava",
                           "portal_vein_and_splenic_vein",
                           "iliac_artery_left",
                           "iliac_vena_left",
                           "spinal_cord",
                           "gluteus_maximus_left",
                           "autochthon_left",
                           "iliopsoas_left",
                           "brain",
                           "Left kidney",
                           "hippocampus"}) {
    EXPECT_EQ(anatomy_of(soft).kind, PartKind::soft) << soft;
    EXPECT_NE(&anatomy_of(soft), &unknown) << soft;
    EXPECT_GT(anatomy_of(soft).youngs_modulus_pa, 0) << soft;
  }
  EXPECT_EQ(unknown.kind, PartKind::soft);
}

// A part of one name is not taken for another that it begins or contains.
TEST(Anatomy, TheNarrowerNameCounts) {
  EXPECT_EQ(anatomy_of("gallbladder").words, "gallbladder");
  EXPECT_EQ(anatomy_of("urinary_bladder").words, "bladder");
  EXPECT_EQ(anatomy_of("pulmonary_vein").words, "pulmonary vein");
  EXPECT_EQ(anatomy_of("portal_vein_and_splenic_vein").words, "portal vein");
  EXPECT_EQ(anatomy_of("tribal").words, "");
  EXPECT_EQ(anatomy_of("").words, "");
  EXPECT_EQ(anatomy_of("lungs").words, "lung*");
}

TEST(Anatomy, RibsAndSternumAreOfTheRibcage) {
  for (const char* one : {"rib_left_7", "Right fifth rib", "sternum", "costal_cartilages", "ribcage"})
    EXPECT_TRUE(is_of_ribcage(one)) << one;
  for (const char* other : {"scapula_left", "vertebrae_T5", "heart", "thyroid_cartilage"})
    EXPECT_FALSE(is_of_ribcage(other)) << other;
}

}  // namespace
}  // namespace limber::scenes
