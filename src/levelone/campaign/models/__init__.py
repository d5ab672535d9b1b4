"""Models that a study can evaluate, one kind a module, all behind one protocol: see :mod:`levelone.campaign.models.protocol`."""
