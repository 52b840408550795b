"""Widgets are tested without a screen; this has to be said before Qt is loaded."""
import os

os.environ['QT_QPA_PLATFORM'] = 'offscreen'
