"""What several models of yarns share: solids, interactions, discretisations, networks of beams, joints."""
